// Validates a scene on the service while it is edited.

import { Problem, Unreachable, post } from "../../api.js";
import { withUploads } from "../../assets.js";
import { debounced, pause } from "../../dom.js";
import { places } from "../../json_text.js";
import { behindScene, problemInScene, requestText } from "../../requests.js";

const IDLE_MS = 250;
// Before a service that does not answer is asked again.
const RETRY_MS = 2000;

/** @import { StoredFile } from "../../assets.js" */

/**
 * @typedef {object} Checked - `text`, `names` and `lacking` are those of `withUploads`.
 * @property {string} text
 * @property {ProblemEntry[]} problems
 * @property {number} more - Problems that are not listed.
 * @property {ProblemEntry[]} warnings
 * @property {Map<string, string[]> | null} names
 * @property {Map<string, string>} lacking
 * @property {PlanDocument | null} plan
 * @property {Error | null} failure
 */

/** @param {(found: Checked) => void} onResult @param {AbortSignal} signal */
export function makeValidation(onResult, signal) {
  /** @type {AbortController | null} */
  let running = null;
  const later = debounced(IDLE_MS, check, signal);
  signal.addEventListener("abort", () => running?.abort());

  /** @param {() => string} written @param {Map<string, Blob | StoredFile>} files @param {QualityDocument | null} quality */
  async function check(written, files, quality) {
    running = new AbortController();
    const { signal: current } = running;
    const found = await tried(written(), files, quality, current);
    if (current.aborted || signal.aborted) return;
    onResult(found);
    if (!(found.failure instanceof Unreachable)) return;
    await pause(RETRY_MS, current);
    if (!current.aborted && !signal.aborted) check(written, files, quality);
  }

  return {
    /**
     * Check a text after a short delay, as it is then; earlier requests are dropped.
     *
     * @param {() => string} written
     * @param {Map<string, Blob | StoredFile>} files
     * @param {QualityDocument | null} quality
     */
    want(written, files, quality) {
      running?.abort();
      later(written, files, quality);
    },
  };
}

/**
 * @param {string} text
 * @param {Map<string, Blob | StoredFile>} files
 * @param {QualityDocument | null} quality
 * @param {AbortSignal} signal
 */
async function tried(text, files, quality, signal) {
  /** @type {Checked} */
  const found = {
    text,
    problems: [],
    more: 0,
    warnings: [],
    names: null,
    lacking: new Map(),
    plan: null,
    failure: null,
  };
  const behind = behindScene(text);
  if (behind) {
    const detail = "The scene has ended: delete what follows its last brace.";
    return { ...found, problems: [{ pointer: "", code: "json_invalid", detail, ...behind }] };
  }
  try {
    Object.assign(found, await withUploads(text, files));
    const plan = await post("/v1/plans", requestText(found.text, { quality }), { signal });
    found.plan = plan;
    found.warnings = placed(text, plan.warnings.map(problemInScene), found);
  } catch (error) {
    if (error instanceof Problem && error.errors.length) {
      found.problems = placed(text, error.errors.map(problemInScene), found);
      found.more = error.more;
    } else if (!signal.aborted) {
      found.failure = error instanceof Error ? error : new Error(String(error));
    }
  }
  return found;
}

/**
 * Add lines to problems for which the service, which read another text, could not give any.
 *
 * @param {string} text
 * @param {ProblemEntry[]} problems
 * @param {Checked} found
 * @returns {ProblemEntry[]}
 */
function placed(text, problems, { names, lacking }) {
  const lost = problems.filter((problem) => !problem.line && problem.pointer.startsWith("/"));
  const where = places(
    text,
    lost.map((problem) => problem.pointer),
  );
  const files = new Map(
    [...lacking].flatMap(([name, why]) => (names?.get(name) ?? []).map((pointer) => [pointer, why])),
  );
  return problems.map((problem) => {
    const { line, column } = (problem.line ? null : where.get(problem.pointer)) ?? problem;
    const meant = problem.suggestion ? ` Did you mean "${problem.suggestion}"?` : "";
    return { ...problem, line, column, detail: files.get(problem.pointer) ?? problem.detail + meant };
  });
}
