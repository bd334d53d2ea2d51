// The page of a comparison: a viewer of two pictures, and what the service says of them.

import { Problem, get, jobPath, messageOf, post } from "../api.js";
import { announce, h } from "../dom.js";
import { field, makeSelect } from "../elements.js";
import { qualityName } from "../format.js";
import { metricsOf } from "./compare/differences.js";
import { makePair } from "./compare/pair.js";
import { encoded, filmOfFile, filmOfJob, readByService } from "./compare/pictures.js";
import { makeScenes } from "./compare/scenes.js";
import { makeDetails, makeNumbers, makeSides, makeVerdict } from "./compare/verdict.js";
import { nameOf } from "./job/state.js";
import { makeComparing } from "./picture/comparing.js";
import { displayOf } from "./picture/controls.js";
import { makeFrame, refuse } from "./picture/frame.js";

export const title = "Compare";

/** @import { Read } from "./compare/pictures.js" @import { Encoding } from "./compare/references.js" */
/** @import { Side } from "./compare/verdict.js" */

// Instead of a job's id: a file still to be chosen.
const FILE = "file";

/** @type {[string, string][]} */
const TABS = [
  ["verdict", "Verdict"],
  ["pixel", "Pixel"],
  ["scenes", "Scenes"],
];

/** @type {[Encoding, string][]} */
const ENCODINGS = [
  ["", "the default of its format"],
  ["srgb", "sRGB"],
  ["linear", "linear"],
];

/** @param {HTMLElement} root @param {ViewParams} params */
export function mount(root, params) {
  open(root, params).catch(
    (error) => params.signal.aborted || refuse(root, "These pictures cannot be compared", error),
  );
}

/**
 * Show A, and B as soon as it is there; without it, what to compare A with instead.
 *
 * @param {HTMLElement} root
 * @param {ViewParams} params
 */
async function open(root, { a, b, signal }) {
  const [one, film] = await Promise.all([sideOf(a, signal), filmOfJob(a, signal)]);
  signal.throwIfAborted();
  const frame = makeFrame(root, "Compare", TABS, signal);
  const pair = makePair(frame, film, signal);
  signal.addEventListener("abort", pair.close);
  pair.explain(a, one.scene, "A");
  pair.expose(displayOf(one.scene));

  const { verdict: panel, scenes } = frame.drawer.panels;
  const result = h("section.compared-verdict", { "aria-label": "Verdict" });
  const sides = h("div", makeSides(one, null));
  const details = h("div.compared-details");
  const another = makeComparing(one.job, pair.address.write, signal);
  const picker = b === FILE ? makePicker((file, encoding) => compare(ofFile(file, encoding))) : "";
  panel.append(picker, result, sides, details, another.element);
  another.fill();
  frame.drawer.addEventListener("change", () => frame.drawer.shown === "verdict" && another.fill());
  if (!picker) await compare(ofJob());

  /** @typedef {{reference: object, read: Read | null}} Other B for the service; null if only that can read it. */

  /** @param {File} file @param {Encoding} encoding @returns {Promise<Other>} */
  async function ofFile(file, encoding) {
    const [content, read] = await Promise.all([encoded(file), filmOfFile(file, encoding)]);
    return { reference: { content, ...(encoding && { encoding }) }, read };
  }

  /** @returns {Promise<Other>} */
  async function ofJob() {
    const [other, second] = await Promise.all([sideOf(b, signal), filmOfJob(b, signal)]);
    signal.throwIfAborted();
    entitle(frame.heading, one.job, other.job);
    sides.replaceChildren(makeSides(one, other));
    scenes.replaceChildren(makeScenes(one.scene, other.scene));
    return { reference: { job: b }, read: { film: second, note: "", scene: other.scene } };
  }

  /** @param {Promise<Other>} reading */
  async function compare(reading) {
    result.setAttribute("aria-busy", "true");
    result.replaceChildren(h("p.soft", { role: "status" }, "Comparing …"));
    try {
      const { reference, read } = await reading;
      /** @type {Promise<ComparisonDocument>} */
      const asking = post("/v1/comparisons", { image: { job: a }, reference, pictures: !read }, { signal });
      const isAlike = read && read.film.width === film.width && read.film.height === film.height;
      const second = isAlike ? read : await readByService(await asking, film);
      signal.throwIfAborted();
      pair.compare(second.film);
      if (second.scene) pair.explain(b, second.scene, "B");
      const { worst, ...metrics } = metricsOf(film, second.film, film.whole);
      const places = { worst, showPixel: pair.showPixel, showRegion: pair.showRegion };
      details.replaceChildren(makeNumbers(metrics, places));
      const answer = await asking;
      const note = h("p.soft.small", second.note);
      result.replaceChildren(makeVerdict(answer), note);
      details.replaceChildren(makeDetails(answer, places));
      announce(answer.reason);
    } catch (error) {
      if (!signal.aborted) result.replaceChildren(refusalOf(error));
    }
    result.removeAttribute("aria-busy");
  }
}

/** Name the two qualities, or the two scenes of one quality. @param {HTMLElement} heading @param {JobDocument[]} jobs */
function entitle(heading, ...jobs) {
  const [a, b] = jobs.map(({ quality }) => qualityName(quality));
  const [one, other] = a === b ? jobs.map(nameOf) : [a, b];
  heading.replaceChildren(h("span", `Compare ${one}`), h("span", ` with ${other}`));
  heading.title = heading.textContent ?? "";
  document.title = `${heading.title} · Penumbra`;
}

/** The form that chooses a file to compare with. @param {(file: File, encoding: Encoding) => void} chosen */
function makePicker(chosen) {
  const file = h("input", { id: "reference-file", type: "file", accept: ".png,.npy,.exr", required: true });
  const encoding = makeSelect({ id: "reference-encoding" }, ENCODINGS);
  const submit = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    if (file.files?.[0]) chosen(file.files[0], /** @type {Encoding} */ (encoding.value));
  };
  return h(
    "form.comparing",
    { onsubmit: submit },
    field("Reference: a PNG, NPY or EXR file", file),
    field("Its values are", encoding),
    h("button.primary", { type: "submit" }, "Compare"),
  );
}

/** @param {string} id @param {AbortSignal} signal @returns {Promise<Side>} */
async function sideOf(id, signal) {
  const [job, { scene }] = await Promise.all([
    get(jobPath(id), { signal }),
    get(`${jobPath(id)}/request`, { signal }),
  ]);
  return { job, scene };
}

/** What is wrong, without places in a request that the user did not write. @param {unknown} error */
function refusalOf(error) {
  const details = error instanceof Problem ? error.errors.map(({ detail }) => detail) : [];
  const text = details.length ? details.join(" ") : messageOf(error);
  return h("p.problem", { role: "alert" }, text);
}
