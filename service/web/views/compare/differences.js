// How far two pictures are apart in each pixel, and in all of them.

import { Layer } from "../picture/layers.js";
import { TRANSFERS } from "../picture/transfer.js";

/** @typedef {import("../picture/film.js").Film} Film */

// The service's default of `limit`.
export const LIMIT = 0.05;

// What the service adds to the squared reference in `relmse`: dark pixels do not decide alone.
const RELATIVE_FLOOR = 0.01;

/** The largest difference of the channels of each pixel, linear. @param {Film} a @param {Film} b */
function absolute(a, b) {
  return largest(a, b, (one, other) => Math.abs(one - other));
}

/** The largest of |a - b| / √(b² + 0.01) of the channels, whose mean square is `relmse`. @param {Film} a @param {Film} b */
function relative(a, b) {
  return largest(a, b, (one, other) => Math.abs(one - other) / Math.sqrt(other * other + RELATIVE_FLOOR));
}

/** @param {Film} a @param {Film} b @param {(one: number, other: number) => number} apart */
function largest({ values: a }, { values: b }, apart) {
  const found = new Float32Array(a.length / 3);
  for (let pixel = 0, i = 0; pixel < found.length; pixel++, i += 3)
    // Two equal infinities are no difference.
    for (let channel = i; channel < i + 3; channel++) {
      const size = a[channel] === b[channel] ? 0 : apart(a[channel], b[channel]);
      if (!(size <= found[pixel])) found[pixel] = size;
    }
  return found;
}

// Steps of linear light in a table of displayed values; between them it is straight.
const FINE = 4096;
const SHOWN = Float64Array.from({ length: FINE + 2 }, (_, step) =>
  TRANSFERS.srgb((Math.min(step, FINE) / FINE) ** 2),
);

/** A linear value as it is displayed, 0 to 1. @param {number} linear */
function shown(linear) {
  // By the root, steps are fine where the eye is.
  const place = linear > 0 ? FINE * Math.sqrt(Math.min(linear, 1)) : 0;
  const step = Math.floor(place);
  return SHOWN[step] + (place - step) * (SHOWN[step + 1] - SHOWN[step]);
}

/** The largest difference of the channels as they are displayed, 0 to 1. @param {Film} a @param {Film} b */
const displayed = (a, b) => largest(a, b, (one, other) => Math.abs(shown(one) - shown(other)));

/**
 * What can be shown of two pictures beside themselves, with the values at which the colours end: the same for all pictures.
 *
 * @type {Record<string, {of: (a: Film, b: Film) => Float32Array, high: number, colors: string}>}
 */
const KINDS = {
  difference: { of: absolute, high: 0.25, colors: "viridis" },
  "relative difference": { of: relative, high: 1, colors: "viridis" },
  // The heat map of the service.
  "displayed difference": { of: displayed, high: 0.25, colors: "heat" },
};

/** The names of differences. */
export const DIFFERENCES = Object.keys(KINDS);

/** A difference in false colours. @param {string} name @param {Film} a @param {Film} b */
export function layerOf(name, a, b) {
  const { of, high, colors } = KINDS[name];
  return new Layer(name, [a.height, a.width], of(a, b), { low: 0, high, log: false, colors });
}

/**
 * @typedef {object} Metrics - Of linear values clipped to 0..1, as `POST /v1/comparisons` defines them.
 * @property {number} rmse
 * @property {number | null} psnr - dB; null for equal pictures.
 * @property {number} relmse
 * @property {number} max_abs
 * @property {number} frac_over
 * @property {PixelPlace | null} worst - The pixel of `max_abs`; null where the pictures are equal.
 */

/** @param {number} value */
const clipped = (value) => (value > 0 ? Math.min(value, 1) : 0);

/**
 * Metrics of a rectangle of two pictures.
 *
 * @param {Film} a
 * @param {Film} b
 * @param {import("../picture/film.js").Rectangle} place
 * @param {number} limit - Of `frac_over`.
 * @returns {Metrics}
 */
export function metricsOf(a, b, { x0, y0, x1, y1 }, limit = LIMIT) {
  let squares = 0;
  let relatives = 0;
  let most = 0;
  /** @type {PixelPlace | null} */
  let worst = null;
  let over = 0;
  for (let y = y0; y < y1; y++) {
    const end = 3 * (y * a.width + x1);
    for (let x = x0, i = 3 * (y * a.width + x0); i < end; x++) {
      let greatest = 0;
      for (let channel = 0; channel < 3; channel++, i++) {
        const reference = clipped(b.values[i]);
        const apart = Math.abs(clipped(a.values[i]) - reference);
        squares += apart * apart;
        relatives += (apart * apart) / (reference * reference + RELATIVE_FLOOR);
        if (apart > greatest) greatest = apart;
      }
      if (greatest > most) [most, worst] = [greatest, { x, y }];
      if (greatest > limit) over++;
    }
  }
  const pixels = (x1 - x0) * (y1 - y0);
  const mse = squares / (3 * pixels);
  return {
    rmse: Math.sqrt(mse),
    psnr: mse > 0 ? -10 * Math.log10(mse) : null,
    relmse: relatives / (3 * pixels),
    max_abs: most,
    frac_over: over / pixels,
    worst,
  };
}
