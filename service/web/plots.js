// Plots on two logarithmic axes, in the colours of the page.

import { h } from "./dom.js";
import uPlot from "./vendor/uplot/uPlot.esm.js";
import { digits } from "./format.js";

/** @import { Axis, Options } from "./vendor/uplot/uPlot.esm.js" */
/**
 * @typedef {{x: number, y: number, low: number, high: number}} Point
 * @typedef {{label: string, xLabel: string, yLabel: string}} Words
 * @typedef {{points: Point[], limit: number | null, marks: number[]}} Content
 */

const HEIGHT = 210;
// The data keep this share of an axis free at both its ends, and ticks are at least this many.
const MARGIN = 0.06;
const FEWEST = 3;
// CSS pixels.
const MARK = 9;

/** A logarithmic range with all values and a margin. @param {number[]} values @returns {[number, number]} */
function around(values) {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const margin = Math.max(1.15, (high / low) ** MARGIN);
  return [low / margin, high * margin];
}

/**
 * Round numbers of a range: decades if they are enough, else finer steps of them, else equal steps.
 *
 * @param {number} low
 * @param {number} high
 */
export function ticks(low, high) {
  const first = Math.floor(Math.log10(low));
  const decades = Array.from(
    { length: Math.ceil(Math.log10(high)) - first + 1 },
    (_, i) => 10 ** (first + i),
  );
  for (const steps of [[1], [1, 2, 5], [1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9]]) {
    const found = decades
      .flatMap((decade) => steps.map((step) => Number((step * decade).toPrecision(2))))
      .filter((tick) => tick >= low && tick <= high);
    if (found.length >= FEWEST) return found;
  }
  const power = 10 ** Math.floor(Math.log10(high - low));
  const steps = [5, 2, 1, 0.5, 0.2, 0.1].map((factor) => factor * power);
  const count = (/** @type {number} */ step) => Math.floor(high / step) - Math.ceil(low / step) + 1;
  const step = steps.find((one) => count(one) >= FEWEST) ?? steps[steps.length - 1];
  const least = Math.ceil(low / step);
  return Array.from({ length: count(step) }, (_, i) => Number(((least + i) * step).toPrecision(6)));
}

function colours() {
  const style = getComputedStyle(document.documentElement);
  return (/** @type {string} */ name) => style.getPropertyValue(`--${name}`).trim();
}

/**
 * Draw the interval of each point, the limit, and marks on the axis below.
 *
 * @param {uPlot} plot
 * @param {Content} content
 * @param {(name: string) => string} colour
 */
function extras(plot, { points, limit, marks }, colour) {
  const { ctx, bbox } = plot;
  const place = (/** @type {number} */ value) => plot.valToPos(value, "y", true);
  /** @param {string} name @param {number[]} dash @param {() => void} path */
  const stroke = (name, dash, path) => {
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.strokeStyle = colour(name);
    ctx.lineWidth = devicePixelRatio * (dash.length ? 1 : 1.5);
    ctx.setLineDash(dash.map((length) => length * devicePixelRatio));
    ctx.beginPath();
    path();
    ctx.stroke();
    ctx.restore();
  };
  stroke("accent", [], () => {
    for (const { x, low, high } of points) {
      const column = plot.valToPos(x, "x", true);
      ctx.moveTo(column, place(high));
      // An interval that reaches down to 0 has no lower end on a logarithmic axis.
      ctx.lineTo(column, low > 0 ? place(low) : bbox.top + bbox.height);
    }
  });
  const foot = bbox.top + bbox.height;
  stroke("line-strong", [], () => {
    for (const x of marks) {
      const column = plot.valToPos(x, "x", true);
      ctx.moveTo(column, foot);
      ctx.lineTo(column, foot - MARK * devicePixelRatio);
    }
  });
  if (limit === null) return;
  stroke("ink-soft", [6, 4], () => {
    ctx.moveTo(bbox.left, place(limit));
    ctx.lineTo(bbox.left + bbox.width, place(limit));
  });
}

/** @param {Words} words @param {number} width @param {Content} content @returns {Options} */
function options({ xLabel, yLabel }, width, content) {
  const colour = colours();
  const font = `12px ${colour("sans")}`;
  /** @param {string} label @param {number} size @returns {Axis} */
  const axis = (label, size) => ({
    label,
    labelFont: font,
    font,
    size,
    labelSize: 20,
    stroke: colour("ink-soft"),
    splits: (_plot, _axis, low, high) => ticks(low, high),
    filter: (_plot, found) => found,
    grid: { stroke: colour("line"), width: 1, filter: (_plot, found) => found },
    ticks: { stroke: colour("line"), width: 1, filter: (_plot, found) => found },
    values: (_plot, found) => found.map(short),
  });
  const accent = colour("accent");
  const times = () => [...content.points.map(({ x }) => x), ...content.marks];
  // An interval may reach down to 0, which has no place on the axis.
  const heights = () =>
    content.points.flatMap(({ y, low, high }) => [y, high, Math.max(low, y / 4)]).concat(content.limit ?? []);
  return {
    width,
    height: HEIGHT,
    legend: { show: false },
    cursor: { drag: { x: false, y: false } },
    scales: {
      x: { time: false, distr: 3, range: () => around(times()) },
      y: { distr: 3, range: () => around(heights()) },
    },
    axes: [axis(xLabel, 34), axis(yLabel, 48)],
    series: [{}, { stroke: accent, width: 2, points: { show: true, size: 8, fill: accent } }],
    hooks: { draw: [(plot) => extras(plot, content, colour)] },
  };
}

/** @param {number} value */
const short = (value) =>
  value >= 0.01 && value < 1e5 ? String(Number(value.toPrecision(3))) : value.toExponential(0);

/**
 * A plot with a line, an interval around it, and a limit.
 *
 * @param {Words} words
 */
export function makePlot(words) {
  const element = h("div", { className: "plot", role: "img", "aria-label": words.label });
  /** @type {Content} */
  const content = { points: [], limit: null, marks: [] };
  /** @type {uPlot | null} */
  let plot = null;

  /** Only points above 0 can be drawn. @param {Point[]} points @param {number | null} limit @param {number[]} marks */
  function draw(points, limit, marks) {
    content.points = points.filter(({ x, y }) => x > 0 && y > 0);
    content.limit = limit;
    content.marks = marks.filter((x) => x > 0);
    if (!content.points.length || !element.clientWidth) return;
    const data = [content.points.map(({ x }) => x), content.points.map(({ y }) => y)];
    const last = content.points[content.points.length - 1];
    element.setAttribute("aria-label", `${words.label}: ${digits(last.y)} after ${digits(last.x)} seconds`);
    if (plot) plot.setData(data);
    else plot = new uPlot(options(words, element.clientWidth, content), data, element);
  }

  function again() {
    plot?.destroy();
    plot = null;
    draw(content.points, content.limit, content.marks);
  }

  const sizes = new ResizeObserver(() => {
    if (plot && plot.width !== element.clientWidth)
      plot.setSize({ width: element.clientWidth, height: HEIGHT });
    else if (!plot) draw(content.points, content.limit, content.marks);
  });
  sizes.observe(element);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  dark.addEventListener("change", again);

  function destroy() {
    sizes.disconnect();
    dark.removeEventListener("change", again);
    plot?.destroy();
    plot = null;
  }

  return { element, draw, destroy };
}
