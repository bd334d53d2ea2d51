// Two pictures on one screen: split along a line, in turn, or their difference.

import { Darkroom } from "../picture/darkroom.js";
import { measured } from "../picture/develop.js";
import { writeScale } from "../picture/layers.js";
import { plainLook } from "../picture/look.js";
import { drawNumbers, short } from "../picture/numbers.js";
import { drawHandle } from "../picture/split.js";
import { Encoder } from "../picture/transfer.js";
import { HOTTEST, absolute, drawHeat, relative } from "./differences.js";

/** @type {Record<string, string>} */
export const MODES = {
  split: "Split",
  a: "A alone",
  b: "B alone",
  difference: "Difference",
  relative: "Relative difference",
  heat: "Heat map",
};

/** What the modes with a scale show of each pixel. */
const APART = { difference: absolute, relative };

// CSS pixels between the line and the letters beside it.
const LABEL_GAP = 8;

export class Blending {
  /** @type {Map<string, Float32Array>} */
  #apart = new Map();
  /** @type {ImageData | null} */
  #image = null;

  /** @param {PictureScreen} screen @param {import("../picture/film.js").Film[]} films - A and B. */
  constructor(screen, films) {
    this.screen = screen;
    this.films = films;
    this.mode = "split";
    this.at = 0.5;
    this.look = plainLook();
    this.darkrooms = films.map((film) => new Darkroom(film));
    this.sheets = films.map(({ width, height }) => new OffscreenCanvas(width, height));
    /** From which value to which the colours go, by mode. @type {Record<string, import("../picture/scales.js").Scale>} */
    this.scales = {
      difference: { low: 0, high: HOTTEST, log: false, colors: "viridis" },
      relative: { low: 0, high: 1, log: false, colors: "viridis" },
    };
    this.#develop();
  }

  close() {
    for (const darkroom of this.darkrooms) darkroom.close();
  }

  /** @param {number} exposure @param {string} transfer */
  expose(exposure, transfer) {
    measured("penumbra:expose", {}, () => {
      this.look = { ...this.look, encoder: new Encoder(exposure, transfer) };
      this.#develop();
      this.draw();
    });
  }

  #develop() {
    this.darkrooms.forEach((darkroom, i) => {
      const context = /** @type {OffscreenCanvasRenderingContext2D} */ (
        this.sheets[i].getContext("2d", { willReadFrequently: true })
      );
      darkroom.paint(context, this.look, darkroom.film.whole);
    });
  }

  /** @param {string} mode - A key of `MODES`. */
  show(mode) {
    this.mode = mode;
    this.draw();
  }

  /** Show A left of a line at a share of the width, and B right of it. @param {number} share */
  split(share) {
    this.at = share;
    this.draw();
  }

  get column() {
    return Math.round(this.at * this.screen.width);
  }

  draw() {
    const { context, width, height } = this.screen;
    const [a, b] = this.sheets;
    const left = this.column;
    if (this.mode === "a") context.drawImage(a, 0, 0);
    else if (this.mode === "b") context.drawImage(b, 0, 0);
    else if (this.mode !== "split") measured("penumbra:difference", {}, () => this.#drawApart());
    else {
      if (left > 0) context.drawImage(a, 0, 0, left, height, 0, 0, left, height);
      if (left < width) context.drawImage(b, left, 0, width - left, height, left, 0, width - left, height);
    }
    this.screen.redraw();
  }

  #drawApart() {
    this.#image ??= new ImageData(this.screen.width, this.screen.height);
    const packed = new Uint32Array(this.#image.data.buffer);
    if (this.mode === "heat") drawHeat(this.films[0], this.films[1], packed);
    else writeScale(packed, this.apart(this.mode), this.scales[this.mode], 0, packed.length);
    this.screen.context.putImageData(this.#image, 0, 0);
  }

  /** What a mode with a scale shows of each pixel. @param {string} mode */
  apart(mode) {
    const known = this.#apart.get(mode);
    if (known) return known;
    const found = APART[/** @type {keyof typeof APART} */ (mode)](this.films[0], this.films[1]);
    this.#apart.set(mode, found);
    return found;
  }

  /** Draw the line between A and B, and the numbers of pixels. @param {CanvasRenderingContext2D} context */
  overlay(context) {
    const { screen } = this;
    drawNumbers(context, screen, (x, y) => this.#lines(x, y), this.#shown());
    if (this.mode !== "split") return;
    const x = screen.left + screen.scale * this.column;
    for (const [style, width] of /** @type {[string, number][]} */ ([
      ["#000", 3],
      ["#fff", 1],
    ])) {
      context.fillStyle = style;
      context.fillRect(x - width / 2, 0, width, screen.element.clientHeight);
    }
    drawHandle(context, x, screen.element.clientHeight);
    label(context, "A", x - LABEL_GAP, "right");
    label(context, "B", x + LABEL_GAP, "left");
  }

  /** @param {number} x @param {number} y */
  describe(x, y) {
    const [a, b] = this.films.map((film) => film.at(x, y)?.map(short).join("  "));
    return `A ${a}   B ${b}`;
  }

  /** @param {number} x @param {number} y */
  #lines(x, y) {
    const [a, b] = this.films.map((film) => film.at(x, y) ?? []);
    if (this.mode === "relative") return [short(this.apart(this.mode)[y * this.screen.width + x])];
    if (this.mode === "difference" || this.mode === "heat") return a.map((value, i) => short(value - b[i]));
    const { encoder } = this.look;
    return (this.#isA(x) ? a : b).map(
      (value) => `${short(value)} ${String(encoder.code(value)).padStart(4)}`,
    );
  }

  /** @param {number} x */
  #isA(x) {
    return this.mode === "a" || (this.mode === "split" && x < this.column);
  }

  /** Gives the codes of visible pixels, which are read once: each reading may wait for a graphics card. */
  #shown() {
    const { x0, y0, x1, y1 } = this.screen.visible();
    /** @type {Uint8ClampedArray | null} */
    let codes = null;
    return (/** @type {number} */ x, /** @type {number} */ y) => {
      codes ??= this.screen.context.getImageData(x0, y0, x1 - x0, y1 - y0).data;
      const from = 4 * ((y - y0) * (x1 - x0) + x - x0);
      return Array.from(codes.subarray(from, from + 3));
    };
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {string} letter
 * @param {number} x
 * @param {CanvasTextAlign} align
 */
function label(context, letter, x, align) {
  Object.assign(context, {
    font: "600 16px sans-serif",
    textAlign: align,
    textBaseline: "top",
    lineWidth: 3,
    strokeStyle: "#000",
    fillStyle: "#fff",
  });
  context.strokeText(letter, x, LABEL_GAP);
  context.fillText(letter, x, LABEL_GAP);
}
