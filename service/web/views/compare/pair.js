// Two pictures in one viewer: divided by a line, in turn, or by their difference.

import { announce, h } from "../../dom.js";
import { field } from "../../elements.js";
import { round } from "../picture/place.js";
import { makeViewer } from "../picture/viewer.js";
import { DIFFERENCES, layerOf } from "./differences.js";
import { catchLine, drawLine, hearSpace } from "./line.js";

/** @import { Film } from "../picture/film.js" @import { Layer } from "../picture/layers.js" */

/** @type {[string, string][]} */
const CHOICES = [
  ["split", "A and B"],
  ["a", "A alone"],
  ["b", "B alone"],
  ...DIFFERENCES.map(
    (name) => /** @type {[string, string]} */ ([name, name[0].toUpperCase() + name.slice(1)]),
  ),
];
const REGION = "#ffb43c";
const MIDDLE = 0.5;
// Pixels on each side of one that is shown, enough to recognize the place.
const AROUND = 15;

/** @param {import("../picture/frame.js").Frame} frame @param {Film} film - A. @param {AbortSignal} signal */
export function makePair(frame, film, signal) {
  const { width } = film;
  const viewer = makeViewer(frame, film, {
    label: "Pictures A and B",
    keys: "Hold Space for B; F switches between A and B.",
    choices: CHOICES,
    choose: show,
    overlay,
    inAddress: () => ({ line: share === MIDDLE ? null : round(100 * share) }),
    signal,
  });
  const { screen, developer, choice, address } = viewer;
  /** @type {Map<string, Layer>} */
  const layers = new Map();
  /** @type {PixelRectangle | null} */
  let region = null;
  let mode = "a";
  const asked = Number(address.asked.get("line") || NaN) / 100;
  // The share of the width left of the line.
  let share = asked >= 0 && asked <= 1 ? asked : MIDDLE;
  /** @type {HTMLInputElement} */
  const line = h("input", {
    id: "split-line",
    type: "range",
    min: 0,
    max: 100,
    step: 0.5,
    value: 100 * share,
    oninput: () => divide(Number(line.value) / 100),
  });
  // Until B is there.
  choice.disabled = true;
  viewer.settings.append(field("Line between A and B", line));
  catchLine(screen, { at: () => (mode === "split" ? share : null), move: divide });
  // Space shows B as long as it is held; the choice of what is shown stays as it is.
  hearSpace((held) => choice.disabled || show(held ? "b" : choice.value), signal);
  addEventListener("keydown", switched, { signal });
  screen.on("clear", () => (region = null));
  viewer.begin();

  /** @param {CanvasRenderingContext2D} context */
  function overlay(context) {
    if (mode === "split") drawLine(context, screen, developer.column);
    if (region) screen.outline(context, region, REGION);
  }

  /** @param {number} at */
  function divide(at) {
    share = at;
    line.value = String(100 * at);
    address.changed();
    if (mode === "split") show(mode);
  }

  /** @param {string} name */
  function show(name) {
    const isOther = mode !== name;
    mode = name;
    const layer = DIFFERENCES.includes(name) ? differing(name) : null;
    if (!layer) developer.split(name === "split" ? Math.round(share * width) : name === "a" ? width : 0);
    if (layer !== developer.layer) viewer.show(layer);
    if (isOther) viewer.changed();
    viewer.readout.show();
  }

  /** @param {string} name */
  function differing(name) {
    const layer = layers.get(name) ?? layerOf(name, developer.films[0], developer.films[1]);
    layers.set(name, layer);
    return layer;
  }

  /** @param {KeyboardEvent} event */
  function switched({ key, ctrlKey, metaKey, altKey, target }) {
    const isTyped = /** @type {Element} */ (target).closest("input:not([type=range]), textarea, select");
    if (key.toLowerCase() !== "f" || ctrlKey || metaKey || altKey || isTyped || choice.disabled) return;
    choice.value = choice.value === "a" ? "b" : "a";
    show(choice.value);
    announce(`Picture ${choice.value.toUpperCase()}`);
  }

  return Object.assign(viewer, {
    /** Compare with B, in place of one before. @param {Film} second */
    compare(second) {
      layers.clear();
      developer.compare(second);
      choice.disabled = false;
      show(choice.value);
    },
    /** @param {PixelPlace} pixel */
    showPixel({ x, y }) {
      screen.frame({ x0: x - AROUND, y0: y - AROUND, x1: x + AROUND + 1, y1: y + AROUND + 1 });
      screen.choose({ x, y });
    },
    /** @param {ComparedRegion} chosen */
    showRegion(chosen) {
      region = chosen === region ? null : chosen;
      screen.redraw();
      if (!region) return;
      screen.frame(chosen);
      announce(`Showing columns ${chosen.x0} to ${chosen.x1 - 1}, rows ${chosen.y0} to ${chosen.y1 - 1}.`);
    },
  });
}
