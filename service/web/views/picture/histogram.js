// How often values occur in a picture, by channel, in steps of a quarter of a stop.

import { UNKNOWN } from "./film.js";
import { MAGNITUDE, brightest } from "./look.js";
import { steps } from "./scales.js";
import { ENTRIES, INFINITE, SHIFT, valueOf } from "./transfer.js";

/** The stops that a histogram shows: from 2^-14 of white to 2^6. */
export const STOPS = { low: -14, high: 6 };
export const PER_STOP = 4;
const BINS = (STOPS.high - STOPS.low) * PER_STOP;

// The bin of a positive float by its first bits, which leave it uncertain by 2^-8 of itself.
const BIN_OF = Uint8Array.from({ length: ENTRIES / 2 }, (_, entry) => {
  const stops = Math.log2(valueOf(((entry + 0.5) << SHIFT) >>> 0));
  return Math.min(BINS - 1, Math.max(0, Math.floor((stops - STOPS.low) * PER_STOP))) || 0;
});

/**
 * @typedef {object} Histogram
 * @property {Uint32Array[]} counts - Of red, green and blue: values in each bin, those beyond the ends in the outermost.
 * @property {number} dark - Values that are not above zero.
 * @property {number} infinite - Values that are infinite or no numbers.
 * @property {number} total - All values.
 */

/** @param {import("./film.js").Film} film @returns {Histogram} Pixels that are not known are left out. */
export function histogramOf({ bits }) {
  const counts = [0, 1, 2].map(() => new Uint32Array(BINS));
  let [dark, infinite, total] = [0, 0, 0];
  for (let channel = 0; channel < 3; channel++) {
    const bins = counts[channel];
    for (let i = channel; i < bits.length; i += 3) {
      const value = bits[i];
      if (value === UNKNOWN) continue;
      total++;
      if ((value & MAGNITUDE) >= INFINITE) infinite++;
      else if (value === 0 || value > MAGNITUDE) dark++;
      else bins[BIN_OF[value >>> SHIFT]]++;
    }
  }
  return { counts, dark, infinite, total };
}

/**
 * The channels of a layer, in steps of its scale.
 *
 * @param {import("./layers.js").Layer} layer
 * @returns {Histogram}
 */
export function histogramOfLayer({ values, channels, range }) {
  const counts = Array.from({ length: channels }, () => new Uint32Array(BINS));
  const step = steps(range, BINS);
  let infinite = 0;
  for (let i = 0; i < values.length; i++)
    if (Number.isFinite(values[i])) counts[i % channels][step(values[i])]++;
    else infinite++;
  return { counts, dark: 0, infinite, total: values.length };
}

/** How many values are clipped to white at an exposure. @param {import("./film.js").Film} film @param {number} exposure */
export function countClipped({ bits }, exposure) {
  const limit = brightest(exposure);
  let count = 0;
  for (let i = 0; i < bits.length; i++) if (bits[i] > limit && bits[i] <= INFINITE) count++;
  return count;
}

// Pixels from which an exposure is chosen: a quantile of so many is exact to a small part of a percent.
const SAMPLED = 1 << 16;
const QUANTILE = 0.99;

/**
 * The exposure at which the brightest 1 % of the pixels are white or clipped, in quarters of a stop.
 *
 * @param {import("./film.js").Film} film
 * @returns {number | null} Stops; null for a picture without light.
 */
export function exposureFor({ values, width, height }) {
  const step = 3 * Math.max(1, Math.floor((width * height) / SAMPLED));
  const found = [];
  for (let i = 0; i < values.length; i += step) {
    const brightest = Math.max(values[i], values[i + 1], values[i + 2]);
    if (Number.isFinite(brightest)) found.push(brightest);
  }
  const sorted = Float32Array.from(found).sort();
  const white = sorted[Math.min(sorted.length - 1, Math.floor(QUANTILE * sorted.length))];
  return white > 0 ? Math.floor(-Math.log2(white) * PER_STOP) / PER_STOP + 0 : null;
}
