// Develops a film on a canvas, on the graphics card where there is one.

import { area } from "./film.js";
import { Gpu, hasGpuFor } from "./gpu.js";
import { develop } from "./software.js";

/** @typedef {import("./film.js").Film} Film @typedef {import("./film.js").Rectangle} Rectangle */

/** A canvas to paint on. @typedef {CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D} Context */

export class Darkroom {
  /** @type {Gpu | null} */
  #gpu = null;
  /** @type {ImageData | null} */
  #sheet = null;

  /** @param {Film} film */
  constructor(film) {
    this.film = film;
    if (hasGpuFor(film.width * film.height)) this.#gpu = Gpu.of(film);
  }

  close() {
    this.#gpu?.close();
    this.#gpu = null;
  }

  /** Note that a rectangle of the film has changed. @param {Rectangle} place */
  changed(place) {
    if (area(place)) this.#gpu?.upload(place);
  }

  /**
   * Paint a rectangle of the film.
   *
   * @param {Context} context
   * @param {import("./look.js").Look} look
   * @param {Rectangle} place
   */
  paint(context, look, place) {
    if (!area(place)) return;
    const { x0, y0, x1, y1 } = place;
    const developed = this.#gpu?.develop(look);
    if (developed) {
      context.clearRect(x0, y0, x1 - x0, y1 - y0);
      context.drawImage(developed, x0, y0, x1 - x0, y1 - y0, x0, y0, x1 - x0, y1 - y0);
      return;
    }
    // A card that was lost does not come back.
    this.#gpu = null;
    const whole = area(place) === area(this.film.whole);
    const image = whole ? this.blank() : new ImageData(x1 - x0, y1 - y0);
    develop(this.film, look, place, new Uint32Array(image.data.buffer));
    context.putImageData(image, x0, y0);
  }

  /** A sheet for a whole picture, always the same one; whatever is on it is painted over. */
  blank() {
    this.#sheet ??= new ImageData(this.film.width, this.film.height);
    return this.#sheet;
  }
}
