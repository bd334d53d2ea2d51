// Develops a film on a canvas, on the graphics card where there is one.

import { UNKNOWN, area } from "./film.js";
import { Gpu, hasGpuFor } from "./gpu.js";
import { CHANNELS } from "./look.js";

/** @typedef {import("./film.js").Film} Film @typedef {import("./film.js").Rectangle} Rectangle */
/** @typedef {import("./look.js").Look} Look */

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

  /** Paint a rectangle of the film. @param {Context} context @param {Look} look @param {Rectangle} place */
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

/**
 * Write the colours of a rectangle of a film without a card; unknown pixels are transparent.
 *
 * @param {Film} film
 * @param {Look} look
 * @param {Rectangle} place
 * @param {Uint32Array} packed - A word of RGBA codes for each pixel of the rectangle.
 */
export function develop(film, look, { x0, y0, x1, y1 }, packed) {
  const count = x1 - x0;
  for (let y = y0; y < y1; y++) {
    const from = y * film.width + x0;
    const to = (y - y0) * count;
    encode(film, look, from, packed, to, count);
    for (let i = 0; i < count; i++) if (film.bits[3 * (from + i)] === UNKNOWN) packed[to + i] = 0;
  }
}

/**
 * @param {Film} film
 * @param {Look} look
 * @param {number} from
 * @param {Uint32Array} packed
 * @param {number} to
 * @param {number} count
 */
function encode(film, { encoder, channel }, from, packed, to, count) {
  if (channel === "rgb") encoder.write(film.bits, 3 * from, packed, to, count);
  else if (channel === "luminance")
    encoder.writeGrey(new Uint32Array(film.luminance.buffer), from, 1, packed, to, count);
  else encoder.writeGrey(film.bits, 3 * from + CHANNELS[channel], 3, packed, to, count);
}
