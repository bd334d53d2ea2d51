// Plots on two logarithmic axes, in the colours of the page.

import { h } from "./dom.js";
import uPlot from "./vendor/uplot/uPlot.esm.js";
import { digits } from "./format.js";

const HEIGHT = 240;

/** Whole decades around a range, so that the axes have ticks even for a narrow range. */
function decades(low, high) {
  return [
    10 ** Math.floor(Math.log10(low)),
    10 ** Math.max(Math.ceil(Math.log10(high)), Math.floor(Math.log10(low)) + 1),
  ];
}

function colours() {
  const style = getComputedStyle(document.documentElement);
  return (name) => style.getPropertyValue(`--${name}`).trim();
}

/** Draw the interval of each point, and the limit. */
function extras(plot, { points, limit }, colour) {
  const { ctx, bbox } = plot;
  const place = (value) => plot.valToPos(value, "y", true);
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
  if (limit === null) return;
  stroke("ink-soft", [6, 4], () => {
    ctx.moveTo(bbox.left, place(limit));
    ctx.lineTo(bbox.left + bbox.width, place(limit));
  });
}

function options({ xLabel, yLabel }, width, content) {
  const colour = colours();
  const font = `12px ${colour("sans")}`;
  const whole = (_plot, ticks) => ticks.map((tick) => (tick === null || !isDecade(tick) ? null : tick));
  const axis = (label, size) => ({
    label,
    labelFont: font,
    font,
    size,
    labelSize: 20,
    stroke: colour("ink-soft"),
    filter: whole,
    grid: { stroke: colour("line"), width: 1, filter: whole },
    ticks: { stroke: colour("line"), width: 1, filter: whole },
    values: (_plot, ticks) => ticks.map((tick) => (tick === null ? "" : short(tick))),
  });
  const accent = colour("accent");
  const range = (pick) => () => decades(Math.min(...pick()), Math.max(...pick()));
  const heights = () =>
    content.points
      .flatMap(({ y, low, high }) => [y, high, Math.max(low, y / 10)])
      .concat(content.limit ?? []);
  return {
    width,
    height: HEIGHT,
    legend: { show: false },
    cursor: { drag: { x: false, y: false } },
    scales: {
      x: { time: false, distr: 3, range: range(() => content.points.map(({ x }) => x)) },
      y: { distr: 3, range: range(heights) },
    },
    axes: [axis(xLabel, 34), axis(yLabel, 48)],
    series: [{}, { stroke: accent, width: 2, points: { show: true, size: 8, fill: accent } }],
    hooks: { draw: [(plot) => extras(plot, content, colour)] },
  };
}

const isDecade = (value) => Math.abs(Math.log10(value) - Math.round(Math.log10(value))) < 1e-9;
const short = (value) =>
  value >= 0.01 && value < 1e5 ? String(Number(value.toPrecision(1))) : value.toExponential(0);

/**
 * A plot with a line, an interval around it, and a limit.
 *
 * @param {{label: string, xLabel: string, yLabel: string}} words
 * @returns {{element: HTMLElement, draw: (points: {x: number, y: number, low: number, high: number}[], limit: number |
 *   null) => void, destroy: () => void}} Only points above 0 can be drawn.
 */
export function makePlot(words) {
  const element = h("div", { className: "plot", role: "img", "aria-label": words.label });
  const content = { points: [], limit: null };
  let plot = null;

  function draw(points, limit) {
    content.points = points.filter(({ x, y }) => x > 0 && y > 0);
    content.limit = limit;
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
    draw(content.points, content.limit);
  }

  const sizes = new ResizeObserver(() => {
    if (plot && plot.width !== element.clientWidth)
      plot.setSize({ width: element.clientWidth, height: HEIGHT });
    else if (!plot) draw(content.points, content.limit);
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
