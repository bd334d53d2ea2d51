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
  let count = 0;
  let sum = 0;
  let least = Infinity;
  let greatest = -Infinity;
  const each = (/** @type {(value: number) => void} */ visit) => {
    for (let y = y0; y < y1; y++)
      for (let x = x0; x < x1; x++) {
        const value = values[channels * (y * width + x) + channel];
        if (Number.isFinite(value)) visit(value);
      }
  };
  each((value) => {
    count++;
    sum += value;
    if (value < least) least = value;
    if (value > greatest) greatest = value;
  });
  const mean = sum / count;
  let squares = 0;
  each((value) => (squares += (value - mean) ** 2));
  return { mean, least, greatest, variance: squares / count, count };
}
