// Develops a film without a graphics card.

import { UNKNOWN } from "./film.js";
import { CHANNELS } from "./look.js";

/** @typedef {import("./film.js").Film} Film @typedef {import("./look.js").Look} Look */

/**
 * Write the colours of a rectangle of a film; unknown pixels are transparent.
 *
 * @param {Film} film
 * @param {Look} look
 * @param {import("./film.js").Rectangle} place
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
