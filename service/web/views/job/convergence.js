// Error against time for this job, and the predicted cost of half the error.

import { get, jobPath } from "../../api.js";
import { h } from "../../dom.js";
import { CODE_VALUE, codeValues, digits, seconds } from "../../format.js";
import { makePlot } from "../../plots.js";

export function mount(root, watch) {
  const plot = makePlot({
    label: "Error in code values against time",
    xLabel: "seconds",
    yLabel: "error, code values (1/255)",
  });
  const words = h("p", { className: "small" });
  const rows = h("tbody");
  const numbers = h("details", { hidden: true }, h("summary", {}, "As a table"), table(rows));
  root.append(h("h2", {}, "Accuracy against time"), plot.element, words, numbers);
  let known = "";

  function show(convergence) {
    const points = convergence.passes.filter(({ error }) => error).map(point);
    plot.element.hidden = !points.length;
    plot.draw(points, convergence.target_error ? convergence.target_error / CODE_VALUE : null);
    numbers.hidden = !points.length;
    rows.replaceChildren(...points.map(row));
    words.replaceChildren(...summary(convergence));
  }

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
  return plot.destroy;
}

function point({ seconds: x, error }) {
  return { x, y: error.estimate / CODE_VALUE, low: error.low / CODE_VALUE, high: error.high / CODE_VALUE };
}

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

function row({ x, y, low, high }) {
  return h(
    "tr",
    {},
    h("td", {}, digits(x, 3)),
    h("td", {}, digits(y, 3)),
    h("td", {}, `${digits(low)} to ${digits(high)}`),
  );
}

function summary({ next_halving: half, target_error: target, reason, passes }) {
  const sentences = [];
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
