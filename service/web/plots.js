// Plots on two logarithmic axes. Places are shares of the plot, so that it grows with its element.

import { h, svg } from "./dom.js";
import { digits } from "./format.js";

/**
 * @typedef {{x: number, y: number, low: number, high: number}} Point
 * @typedef {{label: string, xLabel: string, yLabel: string}} Words
 */

// The data keep this share of an axis free at both its ends, and ticks are at least this many.
const MARGIN = 0.06;
const FEWEST = 3;
// Labels are this far apart: five characters in the narrowest drawer, per cent of an axis.
const APART = 15;
// Per cent of the height, of marks on the axis below.
const MARK = 6;

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

/** A logarithmic axis around values: its ticks, and the place of a value in per cent. @param {number[]} values */
function makeAxis(values) {
  const [low, high] = around(values);
  const at = (/** @type {number} */ value) =>
    Math.min(100, Math.max(0, (100 * Math.log(value / low)) / Math.log(high / low)));
  const found = ticks(low, high);
  return { at, ticks: found, labels: spaced(found, at) };
}

/** Those ticks whose labels do not overlap, the roundest first. @param {number[]} all @param {(value: number) => number} at */
function spaced(all, at) {
  const digitsOf = (/** @type {number} */ tick) => tick.toExponential().split("e")[0];
  const roundest = ["1", "2", "5"].flatMap((round) => all.filter((tick) => digitsOf(tick) === round));
  return [...new Set([...roundest, ...all])].reduce(
    (kept, tick) => (kept.every((one) => Math.abs(at(one) - at(tick)) >= APART) ? [...kept, tick] : kept),
    /** @type {number[]} */ ([]),
  );
}

/** @param {string} kind @param {[number, number]} from - In per cent, from the lower left corner. @param {[number, number]} to */
const line = (kind, [x1, y1], [x2, y2]) =>
  svg("line", { class: kind, x1: `${x1}%`, y1: `${100 - y1}%`, x2: `${x2}%`, y2: `${100 - y2}%` });

/** @param {number} value */
const short = (value) =>
  value >= 0.01 && value < 1e5 ? String(Number(value.toPrecision(3))) : value.toExponential(0);

/** A plot of points with their intervals, a limit, and marks on the axis below. @param {Words} words */
export function makePlot({ label, xLabel, yLabel }) {
  const drawing = svg("svg");
  const element = h("div.plot", { role: "img", "aria-label": label }, drawing);

  /** Only points above 0 can be drawn. @param {Point[]} all @param {number | null} limit @param {number[]} marks */
  function draw(all, limit, marks) {
    const points = all.filter(({ x, y }) => x > 0 && y > 0);
    const last = points.at(-1);
    if (!last) return;
    element.setAttribute("aria-label", `${label}: ${digits(last.y)} after ${digits(last.x)} seconds`);
    const times = marks.filter((x) => x > 0);
    const across = makeAxis([...points.map(({ x }) => x), ...times]);
    // An interval may reach down to 0, which has no place on the axis.
    const up = makeAxis(
      points.flatMap(({ y, low, high }) => [y, high, Math.max(low, y / 4)]).concat(limit ?? []),
    );
    const places = points.map(({ x, y }) => /** @type {[number, number]} */ ([across.at(x), up.at(y)]));
    drawing.replaceChildren(
      ...across.ticks.map((tick) => line("grid", [across.at(tick), 0], [across.at(tick), 100])),
      ...up.ticks.map((tick) => line("grid", [0, up.at(tick)], [100, up.at(tick)])),
      ...across.labels.map((tick) =>
        svg("text", { class: "below", x: `${across.at(tick)}%`, y: "100%" }, short(tick)),
      ),
      ...up.labels.map((tick) => svg("text", { class: "beside", y: `${100 - up.at(tick)}%` }, short(tick))),
      svg("text", { class: "across", x: "50%", y: "100%" }, xLabel),
      svg("text", { class: "up" }, yLabel),
      ...times.map((x) => line("mark", [across.at(x), 0], [across.at(x), MARK])),
      ...(limit ? [line("limit", [0, up.at(limit)], [100, up.at(limit)])] : []),
      ...points.map(({ x, low, high }) =>
        line("interval", [across.at(x), up.at(Math.max(low, 0))], [across.at(x), up.at(high)]),
      ),
      ...places.slice(1).map((place, i) => line("curve", places[i], place)),
      ...places.map(([x, y]) => svg("circle", { cx: `${x}%`, cy: `${100 - y}%`, r: 4 })),
    );
  }

  return { element, draw };
}
