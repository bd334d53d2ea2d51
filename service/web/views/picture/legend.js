// The scale beside false colours.

import { h } from "../../dom.js";
import { viridis } from "./colormaps.js";
import { short } from "./numbers.js";

const WIDTH = 256;
const HEIGHT = 12;

const UNITS = {
  depth: "scene units",
  samples: "camera samples",
  error: "linear, the largest of the channels",
};
const MEANINGS = {
  directions: "Red, green and blue are x, y and z, from −1 to 1.",
  names: "Each number has its own colour; black is no shape.",
};

/** @param {import("./layers.js").Layer} layer */
export function makeLegend(layer) {
  if (layer.kind in MEANINGS) return h("p", { className: "legend soft small" }, MEANINGS[layer.kind]);
  const ends = [layer.low, (layer.low + layer.high) / 2, layer.high].map(short);
  const unit = UNITS[layer.name] ?? "";
  if (layer.kind === "colours")
    return h(
      "p",
      { className: "legend soft small" },
      `Each channel from ${ends[0]} to ${ends[2]}. Grey has no value.`,
    );
  return h(
    "figure",
    { className: "legend" },
    ramp(),
    h(
      "div",
      { className: "legend-ends small" },
      ends.map((end) => h("span", {}, end)),
    ),
    h(
      "figcaption",
      { className: "soft small" },
      `${layer.name}${unit && `, ${unit}`}. Grey is infinite or has no value.`,
    ),
  );
}

function ramp() {
  const canvas = h("canvas", {
    width: WIDTH,
    height: HEIGHT,
    role: "img",
    "aria-label": "Colours from the smallest value to the largest",
  });
  const context = canvas.getContext("2d");
  viridis.forEach((color, x) => {
    context.fillStyle = `rgb(${color.join(" ")})`;
    context.fillRect(x, 0, 1, HEIGHT);
  });
  return canvas;
}
