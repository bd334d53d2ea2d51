// Error against time for this job, and the predicted cost of half the error.

import { get, jobPath } from "../../api.js";
import { h } from "../../dom.js";
import { makeTable } from "../../elements.js";
import { CODE_VALUE, codeValues, digits, plural, seconds } from "../../format.js";
import { makePlot } from "../../plots.js";

/** @import { Frame } from "../picture/frame.js" @import { Watch } from "../../watch.js" */

const HEADINGS = ["Seconds", "Error, code values", "95 % interval"];

const AXES = {
  label: "Error in code values against time",
  xLabel: "seconds",
  yLabel: "error, code values",
};

/** @param {Frame} frame @param {Watch} watch */
export function mount({ drawer }, watch) {
  const plot = makePlot(AXES);
  const words = h("p.small");
  const table = h("div");
  const numbers = h("details", { hidden: true }, h("summary", "Show table"), table);
  drawer.panels.render.append(h("h2", "Accuracy against time"), plot.element, words, numbers);
  let known = "";

  /** @param {ConvergenceDocument} convergence */
  function show(convergence) {
    const { passes, target_error: target } = convergence;
    const points = passes.flatMap(({ seconds, error }) => (error ? point(seconds, error) : []));
    const others = passes.filter(({ error }) => !error);
    plot.element.hidden = !points.length;
    plot.draw(
      points,
      target ? target / CODE_VALUE : null,
      others.map(({ seconds: x }) => x),
    );
    numbers.hidden = !points.length;
    table.replaceChildren(makeTable(".numbers", HEADINGS, passes.map(row)));
    words.replaceChildren(...summary(convergence));
  }

  /** @param {JobDocument} job */
  async function refresh(job) {
    const now = `${job.state} ${job.error?.estimate ?? ""}`;
    if (now === known) return;
    known = now;
    try {
      show(await get(`${jobPath(watch.id)}/convergence`, { signal: watch.signal }));
    } catch {
      // The next update of the job fetches it again.
      known = "";
    }
  }

  watch.on("job", refresh);
  refresh(watch.job);
}

/** @param {number} x - Seconds. @param {PredictedNumber} error */
function point(x, error) {
  return { x, y: error.estimate / CODE_VALUE, low: error.low / CODE_VALUE, high: error.high / CODE_VALUE };
}

/** @param {ConvergencePass} pass */
function row({ seconds: x, error }) {
  if (!error) return [digits(x, 3), "–", "no estimate"];
  const range = `${codeValues(error.low)} to ${codeValues(error.high)}`;
  return [digits(x, 3), digits(error.estimate / CODE_VALUE, 3), range];
}

/** @param {ConvergenceDocument} convergence */
function summary({ next_halving: half, target_error: target, reason, passes }) {
  /** @type {(string | Node)[]} */
  const sentences = [];
  const without = passes.filter(({ error }) => !error).length;
  if (without && without < passes.length)
    sentences.push(`Ticks on the time axis are ${plural(without, "pass", "passes")} without an estimate. `);
  if (target) sentences.push(`The dashed line is the target error, ${codeValues(target)} code values. `);
  if (half) {
    const { estimate, low, high } = half.seconds;
    const range = high === null ? `at least ${seconds(low)}` : `${seconds(low)} to ${seconds(high)}`;
    sentences.push(
      "Half this error would cost ",
      h("strong", `about ${seconds(estimate)} more`),
      ` (${range}). `,
    );
  }
  if (!half && reason) sentences.push(reason);
  if (!half && !reason && !passes.length) sentences.push("There are no measurements yet.");
  return sentences;
}
