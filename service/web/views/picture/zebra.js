// Zebra stripes over clipped pixels, as wide on the display at every zoom.

import { h } from "../../dom.js";
import { UNKNOWN } from "./film.js";
import { MAGNITUDE, brightest } from "./look.js";
import { INFINITE } from "./transfer.js";

/** @typedef {import("./film.js").Film} Film */

// As words of RGBA codes.
export const TOO_BRIGHT = 0xff0000ff;
export const TOO_DARK = 0xffff4000;
export const NO_NUMBER = 0xffff00ff;

// Bits of the number 0 with a sign, which is the last before negative numbers.
const NEGATIVE = 0x80000000;
// CSS pixels across a stripe.
const STRIPE = 4;

/**
 * The marks of a film, in blocks of pixels: a block has the mark of its first clipped pixel, so that none is lost where many
 * pixels share one of the display.
 *
 * @param {Film} film
 * @param {number} exposure
 * @param {number} block - Pixels along a side.
 * @returns {{words: Uint32Array<ArrayBuffer>, columns: number}} A colour for each block, 0 without a mark.
 */
export function marksOf({ bits, width, height }, exposure, block) {
  const limit = brightest(exposure);
  const columns = Math.ceil(width / block);
  const words = new Uint32Array(columns * Math.ceil(height / block));
  for (let y = 0, from = 0; y < height; y++) {
    const row = columns * Math.floor(y / block);
    for (let x = 0; x < width; x++, from += 3) {
      const mark = markOf(bits, from, limit);
      if (mark) words[row + Math.floor(x / block)] ||= mark;
    }
  }
  return { words, columns };
}

/** @param {Uint32Array} bits @param {number} from @param {number} limit */
function markOf(bits, from, limit) {
  if (bits[from] === UNKNOWN) return 0;
  let color = 0;
  for (let i = from; i < from + 3; i++) {
    const value = bits[i];
    if ((value & MAGNITUDE) > INFINITE) return NO_NUMBER;
    if (value > NEGATIVE) color ||= TOO_DARK;
    else if (value > limit && value < NEGATIVE) color = TOO_BRIGHT;
  }
  return color;
}

/** A switch of the stripes. @param {import("./develop.js").Developer} developer */
export function makeZebra(developer) {
  const { screen } = developer;
  /** @type {WeakMap<Film, {key: string, canvas: OffscreenCanvas}>} */
  let known = new WeakMap();
  /** @type {HTMLInputElement} */
  const box = h("input", { type: "checkbox", onchange: () => screen.redraw() });
  const title = "Red stripes: brighter than white. Blue stripes: below zero. Magenta: not a number.";

  /** @param {Film} film @param {number} block */
  function canvasOf(film, block) {
    const { exposure } = developer.look.encoder;
    const key = `${exposure} ${block}`;
    const before = known.get(film);
    if (before?.key === key) return before.canvas;
    const { words, columns } = marksOf(film, exposure, block);
    const image = new ImageData(new Uint8ClampedArray(words.buffer), columns);
    const canvas = new OffscreenCanvas(image.width, image.height);
    /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext("2d")).putImageData(image, 0, 0);
    known.set(film, { key, canvas });
    return canvas;
  }

  /** @param {CanvasRenderingContext2D} context @param {Film} film @param {number} x0 @param {number} x1 */
  function drawFilm(context, film, x0, x1) {
    const { left, top, scale, height } = screen;
    const block = Math.max(1, Math.ceil(1 / screen.zoomed));
    const marks = canvasOf(film, block);
    context.save();
    context.beginPath();
    context.rect(left + scale * x0, top, scale * (x1 - x0), scale * height);
    context.clip();
    context.imageSmoothingEnabled = false;
    context.drawImage(marks, left, top, scale * block * marks.width, scale * block * marks.height);
    context.restore();
  }

  return {
    element: h("label.zebra", { title }, box, "Mark clipped pixels"),
    /** Note that a film has changed. */
    changed: () => (known = new WeakMap()),
    /** Draw the marks, before anything else is drawn over the picture. @param {CanvasRenderingContext2D} context */
    draw(context) {
      if (!box.checked || developer.layer) return;
      const { column, films } = developer;
      const { width } = screen;
      if (column > 0) drawFilm(context, films[0], 0, column);
      if (column < width) drawFilm(context, films[1], column, width);
      context.globalCompositeOperation = "source-atop";
      context.fillStyle = stripes(context);
      context.fillRect(0, 0, screen.element.clientWidth, screen.element.clientHeight);
      context.globalCompositeOperation = "source-over";
    },
  };
}

/** Dark diagonal stripes with nothing between them. @param {CanvasRenderingContext2D} context */
function stripes(context) {
  const side = 2 * STRIPE;
  const tile = new OffscreenCanvas(side, side);
  const drawn = /** @type {OffscreenCanvasRenderingContext2D} */ (tile.getContext("2d"));
  drawn.fillStyle = "rgb(0 0 0 / 55%)";
  for (let y = 0; y < side; y++)
    for (let x = 0; x < side; x++) if (Math.floor((x + y) / STRIPE) % 2) drawn.fillRect(x, y, 1, 1);
  return /** @type {CanvasPattern} */ (context.createPattern(tile, "repeat"));
}
