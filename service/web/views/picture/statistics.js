// Mean, least and greatest value, and variance of each channel in a rectangle.

/**
 * @typedef {object} Statistics
 * @property {number} mean
 * @property {number} least
 * @property {number} greatest
 * @property {number} variance - Of the values, divided by their number.
 * @property {number} count - Finite values; the others are left out.
 */

/**
 * @param {ArrayLike<number>} values - By row, pixel and channel.
 * @param {number} channels
 * @param {number} width
 * @param {import("./film.js").Rectangle} place
 * @returns {Statistics[]} Of each channel.
 */
export function statisticsOf(values, channels, width, place) {
  return Array.from({ length: channels }, (_, channel) => one(values, channels, channel, width, place));
}

/**
 * Two passes: the squares of what is left of the mean do not cancel.
 *
 * @param {ArrayLike<number>} values
 * @param {number} channels
 * @param {number} channel
 * @param {number} width
 * @param {import("./film.js").Rectangle} place
 * @returns {Statistics}
 */
function one(values, channels, channel, width, { x0, y0, x1, y1 }) {
  const from = (/** @type {number} */ y) => channels * (y * width + x0) + channel;
  const row = channels * (x1 - x0);
  let count = 0;
  let sum = 0;
  let least = Infinity;
  let greatest = -Infinity;
  for (let y = y0; y < y1; y++)
    for (let i = from(y); i < from(y) + row; i += channels) {
      const value = values[i];
      if (!Number.isFinite(value)) continue;
      count++;
      sum += value;
      if (value < least) least = value;
      if (value > greatest) greatest = value;
    }
  const mean = sum / count;
  let squares = 0;
  for (let y = y0; y < y1; y++)
    for (let i = from(y); i < from(y) + row; i += channels)
      if (Number.isFinite(values[i])) squares += (values[i] - mean) ** 2;
  return { mean, least, greatest, variance: squares / count, count };
}
