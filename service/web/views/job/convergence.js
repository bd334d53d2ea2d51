// Error against time for this job, and the predicted cost of half the error.

import { get, jobPath } from "../../api.js";
import { h } from "../../dom.js";
import { CODE_VALUE, codeValues, digits, plural, seconds } from "../../format.js";
import { makePlot } from "../../plots.js";

/** @import { Frame } from "../picture/frame.js" @import { Watch } from "../../watch.js" */

/** @param {Frame} frame @param {Watch} watch */
export function mount({ drawer }, watch) {
  const plot = makePlot({
    label: "Error in code values against time",
    xLabel: "seconds",
    yLabel: "error, code values",
  });
  const words = h("p", { className: "small" });
  const rows = h("tbody");
  const numbers = h("details", { hidden: true }, h("summary", {}, "Show table"), table(rows));
  drawer.panels.render.append(h("h2", {}, "Accuracy against time"), plot.element, words, numbers);
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
    numbers.hidden = !passes.length;
    rows.replaceChildren(...passes.map(row));
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
  return () => {};
}

/** @param {number} x - Seconds. @param {PredictedNumber} error */
function point(x, error) {
  return { x, y: error.estimate / CODE_VALUE, low: error.low / CODE_VALUE, high: error.high / CODE_VALUE };
}

/** @param {HTMLElement} rows */
function table(rows) {
  const head = h(
    "tr",
    {},
    h("th", { scope: "col" }, "Seconds"),
    h("th", { scope: "col" }, "Error, code values"),
    h("th", { scope: "col" }, "95 % interval"),
  );
  return h("table", { className: "numbers" }, h("thead", {}, head), rows);
}

/** @param {ConvergencePass} pass */
function row({ seconds: x, error }) {
  return h(
    "tr",
    {},
    h("td", {}, digits(x, 3)),
    h("td", {}, error ? digits(error.estimate / CODE_VALUE, 3) : "–"),
    h("td", {}, error ? `${codeValues(error.low)} to ${codeValues(error.high)}` : "no estimate"),
  );
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
      h("strong", {}, `about ${seconds(estimate)} more`),
      ` (${range}). `,
    );
  }
  if (!half && reason) sentences.push(reason);
  if (!half && !reason && !passes.length) sentences.push("There are no measurements yet.");
  return sentences;
}
