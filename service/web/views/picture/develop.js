// Draws a film or a layer on a screen, and the numbers in its pixels.

import { drawNumbers, short } from "./numbers.js";
import { Encoder, code } from "./transfer.js";

/** Measure the duration of a function on the browser's timeline; only the newest measure of a name is kept. */
export function measured(name, detail, work) {
  const start = performance.now();
  const result = work();
  performance.clearMeasures(name);
  performance.measure(name, { start, end: performance.now(), detail });
  return result;
}

export class Developer {
  /** @param {import("./screen.js").Screen} screen @param {import("./film.js").Film} film */
  constructor(screen, film) {
    Object.assign(this, { screen, film, layer: null });
  }

  /** Take a batch of tiles. */
  take(tiles) {
    measured("penumbra:paint", { tiles: tiles.length }, () => {
      const places = tiles.map((tile) => this.film.take(tile));
      if (!this.layer) this.#putAll(places);
      this.screen.redraw();
    });
  }

  expose(exposure, transfer) {
    measured("penumbra:expose", { pixels: this.film.width * this.film.height }, () => {
      this.film.encoder = new Encoder(exposure, transfer);
      if (!this.layer) this.#whole();
    });
  }

  /** Show a layer, or the picture where it is null. */
  show(layer) {
    this.layer = layer;
    if (layer) this.screen.context.putImageData(layer.develop(), 0, 0);
    else this.#whole();
    this.screen.redraw();
  }

  codes(x, y) {
    const { exposure, transfer } = this.film.encoder;
    return this.film.at(x, y)?.map((value) => code(value, exposure, transfer)) ?? null;
  }

  /** The values of a pixel as text. */
  describe(x, y) {
    if (this.layer) return `${this.layer.name} ${this.layer.at(x, y).map(short).join("  ")}`;
    const values = this.film.at(x, y);
    return values
      ? `linear ${values.map(short).join("  ")}   shown ${this.codes(x, y).join("  ")}`
      : "not rendered yet";
  }

  drawNumbers(context) {
    const { screen, layer } = this;
    if (layer)
      return drawNumbers(
        context,
        screen,
        (x, y) => layer.at(x, y).map(short),
        (x, y) => this.#shown(x, y),
      );
    const lines = (x, y) => {
      const codes = this.codes(x, y);
      return codes && this.film.at(x, y).map((value, i) => `${short(value)} ${String(codes[i]).padStart(4)}`);
    };
    drawNumbers(context, screen, lines, (x, y) => this.codes(x, y));
  }

  #shown(x, y) {
    return Array.from(this.screen.context.getImageData(x, y, 1, 1).data.subarray(0, 3));
  }

  #whole() {
    this.#put({ x0: 0, y0: 0, x1: this.film.width, y1: this.film.height });
  }

  /** Develop neighbouring tiles in one call: a call costs more than some more pixels. */
  #putAll(places) {
    const box = around(places);
    const covered = places.reduce((sum, place) => sum + area(place), 0);
    if (places.length > 1 && area(box) <= 2 * covered) this.#put(box);
    else for (const place of places) this.#put(place);
  }

  #put(place) {
    if (place.x1 > place.x0 && place.y1 > place.y0)
      this.screen.context.putImageData(this.film.develop(place), place.x0, place.y0);
  }
}

const area = ({ x0, y0, x1, y1 }) => (x1 - x0) * (y1 - y0);

function around(places) {
  const box = { x0: Infinity, y0: Infinity, x1: 0, y1: 0 };
  for (const { x0, y0, x1, y1 } of places) {
    Object.assign(box, {
      x0: Math.min(box.x0, x0),
      y0: Math.min(box.y0, y0),
      x1: Math.max(box.x1, x1),
      y1: Math.max(box.y1, y1),
    });
  }
  return box;
}
