// The scale beside false colours, whose ends and colours can be changed.

import { h } from "../../dom.js";
import { makeSelect } from "../../elements.js";
import { COLORMAPS, paletteOf, unpack } from "./colormaps.js";
import { short } from "./numbers.js";
import { isScale, leastPositive, middleOf } from "./scales.js";

const WIDTH = 256;
const HEIGHT = 12;

/** @type {Record<string, string>} */
const UNITS = {
  depth: "scene units",
  samples: "camera samples",
  error: "linear, the largest of the channels",
  difference: "the largest of the channels, linear",
  "relative difference": "the largest |A − B| / √(B² + 0.01) of the channels, linear",
  "displayed difference": "the largest of the channels",
};
/** @type {Record<string, string>} */
const MEANINGS = {
  directions: "Red, green and blue are x, y and z, from −1 to 1.",
  names: "Each number has its own colour; black means no shape.",
};

/** @typedef {import("./scales.js").Scale} Scale */

/**
 * The legend of a layer.
 *
 * @param {import("./layers.js").Layer} layer
 * @param {() => void} changed - Called after its scale has changed.
 * @returns {HTMLElement}
 */
export function makeLegend(layer, changed) {
  if (layer.kind in MEANINGS) return h("p.legend.soft.small", MEANINGS[layer.kind]);
  if (layer.kind === "colours") {
    const [low, high] = [layer.scale.low, layer.scale.high].map(short);
    return h("p.legend.soft.small", `Each channel from ${low} to ${high}. Grey has no value.`);
  }
  const unit = UNITS[layer.name] ?? "";
  const caption = `${layer.name}${unit && `, ${unit}`}. Grey is infinite or has no value.`;
  const change = (/** @type {Scale} */ scale) => ((layer.scale = scale), changed());
  return makeScale(layer.scale, leastPositive(layer.values), caption, change);
}

/** A number as it is typed. @param {number} value */
const typed = (value) => String(Number(value.toPrecision(4)));

/**
 * A scale of colours with its ends.
 *
 * @param {Scale} begun
 * @param {number} least - The least value above zero, where a logarithmic scale can begin.
 * @param {string} caption
 * @param {(scale: Scale) => void} changed
 */
function makeScale(begun, least, caption, changed) {
  let scale = begun;
  const ramp = h("canvas", { width: WIDTH, height: HEIGHT, role: "img", "aria-label": "Colour scale" });
  const middle = h("output.number");
  const low = end("Lowest value", (value) => ({ low: value }));
  const high = end("Highest value", (value) => ({ high: value }));
  /** @type {HTMLInputElement} */
  const log = h("input", {
    type: "checkbox",
    disabled: !(least < Infinity),
    onchange: () => set(logarithmic()),
  });
  /** @type {HTMLSelectElement} */
  const colors = makeSelect(
    { "aria-label": "Colours", onchange: () => set({ colors: colors.value }) },
    COLORMAPS.map((name) => [name, name]),
  );
  const reset = h("button.plain", { onclick: () => set(begun) }, "Reset");

  /** @param {string} label @param {(value: number) => Partial<Scale>} part */
  function end(label, part) {
    const input = h("input", { inputMode: "decimal", "aria-label": label, title: label });
    input.addEventListener("change", () => set(part(Number(input.value.replace("−", "-")))));
    return input;
  }

  // A logarithmic scale cannot begin at zero.
  const logarithmic = () => ({ log: log.checked, low: log.checked && scale.low <= 0 ? least : scale.low });

  /** @param {Partial<Scale>} part */
  function set(part) {
    const wanted = { ...scale, ...part };
    if (!isScale(wanted)) return show();
    scale = wanted;
    show();
    changed(scale);
  }

  function show() {
    low.value = typed(scale.low);
    high.value = typed(scale.high);
    middle.textContent = short(middleOf(scale));
    log.checked = scale.log;
    colors.value = scale.colors;
    paint(ramp, scale.colors);
  }

  show();
  return h(
    "figure.legend",
    ramp,
    h("div.legend-ends.small", low, middle, high),
    h("div.row.small.legend-choices", h("label", log, " logarithmic"), colors, reset),
    h("figcaption.soft.small", caption),
  );
}

/** @param {HTMLCanvasElement} canvas @param {string} colors */
function paint(canvas, colors) {
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  paletteOf(colors).forEach((color, x) => {
    context.fillStyle = `rgb(${unpack(color).join(" ")})`;
    context.fillRect(x, 0, 1, HEIGHT);
  });
}
