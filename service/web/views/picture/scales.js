// From which value to which false colours go, and whether by equal differences or equal ratios.

/**
 * @typedef {object} Scale
 * @property {number} low - The value of the first colour.
 * @property {number} high - The value of the last colour.
 * @property {boolean} log - Equal ratios are equal steps.
 * @property {string} colors - One of `COLORMAPS`.
 */

/** A scale over all finite values. @param {ArrayLike<number>} values @returns {Scale} */
export function scaleOf(values) {
  let low = Infinity;
  let high = -Infinity;
  for (let i = 0; i < values.length; i++) {
    const value = values[i];
    if (value < low && value > -Infinity) low = value;
    if (value > high && value < Infinity) high = value;
  }
  return low <= high
    ? { low, high, log: false, colors: "viridis" }
    : { low: 0, high: 0, log: false, colors: "viridis" };
}

/** The least value above zero. @param {ArrayLike<number>} values @returns {number} Infinity if there is none. */
export function leastPositive(values) {
  let least = Infinity;
  for (let i = 0; i < values.length; i++) if (values[i] > 0 && values[i] < least) least = values[i];
  return least;
}

/** Whether the ends of a scale make sense. @param {Scale} scale */
export const isScale = ({ low, high, log }) =>
  Number.isFinite(low) && Number.isFinite(high) && low < high && (!log || low > 0);

/**
 * Which of some equal steps a value is in.
 *
 * @param {Scale} scale
 * @param {number} count
 * @returns {(value: number) => number} From a finite value to 0 .. count - 1.
 */
export function steps({ low, high, log }, count) {
  const last = count - 1;
  const begin = log ? Math.log(low) : low;
  const gain = last / ((log ? Math.log(high) : high) - begin || 1);
  return (value) => {
    if (!(value > low)) return 0;
    if (value >= high) return high > low ? last : 0;
    return Math.round(((log ? Math.log(value) : value) - begin) * gain);
  };
}

/** The value in the middle of a scale. @param {Scale} scale */
export const middleOf = ({ low, high, log }) => (log ? Math.sqrt(low * high) : (low + high) / 2);
