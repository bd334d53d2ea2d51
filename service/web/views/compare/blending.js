// Two pictures on one screen: split along a line, in turn, or their difference.

import { drawNumbers, short } from "../picture/numbers.js";
import { viridis } from "../picture/colormaps.js";
import { drawHandle } from "../picture/split.js";
import { Encoder, code } from "../picture/transfer.js";

export const MODES = {
  split: "Split",
  a: "A alone",
  b: "B alone",
  difference: "Difference",
  heat: "Heat map",
};

// The linear difference at the end of the scale, as in the heat map; the same for all pictures.
export const HOTTEST = 0.25;

// CSS pixels between the line and the letters beside it.
const LABEL_GAP = 8;

export class Blending {
  /** @param {import("../picture/screen.js").Screen} screen @param {import("../picture/film.js").Film[]} films - A and B. */
  constructor(screen, films, heat) {
    Object.assign(this, { screen, films, heat, mode: "split", at: 0.5 });
    this.sheets = films.map(({ width, height }) => new OffscreenCanvas(width, height));
    this.difference = differenceOf(films);
    this.expose(0, "srgb");
  }

  expose(exposure, transfer) {
    const encoder = new Encoder(exposure, transfer);
    this.films.forEach((film, i) => {
      film.encoder = encoder;
      const whole = { x0: 0, y0: 0, x1: film.width, y1: film.height };
      this.sheets[i].getContext("2d").putImageData(film.develop(whole), 0, 0);
    });
    this.draw();
  }

  show(mode) {
    this.mode = mode;
    this.draw();
  }

  /** Show A left of a line at a share of the width, and B right of it. */
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
    else if (this.mode === "difference") context.putImageData(this.difference, 0, 0);
    else if (this.mode === "heat") context.drawImage(this.heat, 0, 0);
    else {
      if (left > 0) context.drawImage(a, 0, 0, left, height, 0, 0, left, height);
      if (left < width) context.drawImage(b, left, 0, width - left, height, left, 0, width - left, height);
    }
    this.screen.redraw();
  }

  /** Draw the line between A and B, and the numbers of pixels. */
  overlay(context) {
    const { screen } = this;
    drawNumbers(
      context,
      screen,
      (x, y) => this.#lines(x, y),
      (x, y) => this.#shown(x, y),
    );
    if (this.mode !== "split") return;
    const x = screen.left + screen.scale * this.column;
    for (const [style, width] of [
      ["#000", 3],
      ["#fff", 1],
    ]) {
      context.fillStyle = style;
      context.fillRect(x - width / 2, 0, width, screen.element.clientHeight);
    }
    drawHandle(context, x, screen.element.clientHeight);
    for (const [letter, side, align] of [
      ["A", -1, "right"],
      ["B", 1, "left"],
    ])
      label(context, letter, x + side * LABEL_GAP, align);
  }

  describe(x, y) {
    const [a, b] = this.films.map((film) => film.at(x, y).map(short).join("  "));
    return `A ${a}   B ${b}`;
  }

  #lines(x, y) {
    const [a, b] = this.films.map((film) => film.at(x, y));
    if (this.mode === "difference" || this.mode === "heat") return a.map((value, i) => short(value - b[i]));
    return (this.#isA(x) ? a : b).map((value) => `${short(value)} ${String(this.#code(value)).padStart(4)}`);
  }

  #isA(x) {
    return this.mode === "a" || (this.mode === "split" && x < this.column);
  }

  #code(value) {
    const { exposure, transfer } = this.films[0].encoder;
    return code(value, exposure, transfer);
  }

  #shown(x, y) {
    return Array.from(this.screen.context.getImageData(x, y, 1, 1).data.subarray(0, 3));
  }
}

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

/** The largest difference of the channels, in false colours. */
function differenceOf([a, b]) {
  const image = new ImageData(a.width, a.height);
  for (let pixel = 0; pixel < a.width * a.height; pixel++) {
    let worst = 0;
    for (let i = 3 * pixel; i < 3 * pixel + 3; i++)
      worst = Math.max(worst, Math.abs(a.values[i] - b.values[i]));
    image.data.set([...viridis[Math.round(255 * Math.min(1, worst / HOTTEST))], 255], 4 * pixel);
  }
  return image;
}
