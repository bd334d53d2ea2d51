// Error against time for this job, and what half the error would cost.

import { get, jobPath } from "../../api.js";
import { h } from "../../dom.js";
import { STEP, digits, seconds, steps } from "../../format.js";
import { makePlot } from "../../plots.js";

export function mount(root, watch) {
  const plot = makePlot({
    label: "Error in steps of 8 bits against seconds",
    xLabel: "seconds",
    yLabel: "error, steps of 8 bits",
  });
  const words = h("p", { className: "small" });
  const rows = h("tbody");
  const numbers = h("details", { hidden: true }, h("summary", {}, "The same as numbers"), table(rows));
  root.append(h("h2", {}, "Accuracy against time"), plot.element, words, numbers);
  let known = "";

  function show(convergence) {
    const points = convergence.passes.filter(({ error }) => error).map(point);
    plot.element.hidden = !points.length;
    plot.draw(points, convergence.target_error ? convergence.target_error / STEP : null);
    numbers.hidden = !points.length;
    rows.replaceChildren(...points.map(row));
    words.replaceChildren(...told(convergence));
  }

  async function refresh(job) {
    const now = `${job.state} ${job.error?.estimate ?? ""}`;
    if (now === known) return;
    known = now;
    try {
      show(await get(`${jobPath(watch.id)}/convergence`, { signal: watch.signal }));
    } catch {
      // The next news of the job asks again.
      known = "";
    }
  }

  watch.on("job", refresh);
  refresh(watch.job);
  return plot.destroy;
}

function point({ seconds: x, error }) {
  return { x, y: error.estimate / STEP, low: error.low / STEP, high: error.high / STEP };
}

function table(rows) {
  const head = h(
    "tr",
    {},
    h("th", { scope: "col" }, "Seconds"),
    h("th", { scope: "col" }, "Error, steps"),
    h("th", { scope: "col" }, "95 of 100 between"),
  );
  return h("table", { className: "numbers" }, h("thead", {}, head), rows);
}

function row({ x, y, low, high }) {
  return h(
    "tr",
    {},
    h("td", {}, digits(x, 3)),
    h("td", {}, digits(y, 3)),
    h("td", {}, `${digits(low)} and ${digits(high)}`),
  );
}

function told({ next_halving: half, target_error: target, reason, passes }) {
  const sentences = [];
  if (target) sentences.push(`Asked for: ${steps(target)} steps, the dashed line. `);
  if (half) {
    const { estimate, low, high } = half.seconds;
    const range = high === null ? `${seconds(low)} at least` : `${seconds(low)} to ${seconds(high)}`;
    sentences.push(
      "Half this error would cost ",
      h("strong", {}, `about ${seconds(estimate)} more`),
      ` (${range}). `,
    );
  }
  if (!half && reason) sentences.push(reason);
  if (!half && !reason && !passes.length) sentences.push("Nothing is known yet.");
  return sentences;
}
