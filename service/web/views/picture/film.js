// The picture received so far, as linear floats.

import { luma } from "./transfer.js";

/** The bits of a pixel that is not there yet: a NaN that no arithmetic makes. */
export const UNKNOWN = 0xffffffff;

/** @typedef {{x0: number, y0: number, x1: number, y1: number}} Rectangle */
/** @typedef {Rectangle & {stride: number, columns: number, pixels: Float32Array}} Tile */

/** How many pixels there are in a rectangle. @param {Rectangle} place */
export const area = ({ x0, y0, x1, y1 }) => (x1 - x0) * (y1 - y0);

/** @param {Tile} tile @param {number} width @param {number} height @returns {Rectangle} */
const clipped = (tile, width, height) => ({
  x0: Math.min(tile.x0, width),
  y0: Math.min(tile.y0, height),
  x1: Math.min(tile.x1, width),
  y1: Math.min(tile.y1, height),
});

export class Film {
  /** @type {Float32Array | null} */
  #luminance = null;

  /** @param {number} width @param {number} height */
  constructor(width, height) {
    this.width = width;
    this.height = height;
    this.values = new Float32Array(3 * width * height);
    this.bits = new Uint32Array(this.values.buffer);
    this.bits.fill(UNKNOWN);
    /** Whether no pixel is known. */
    this.empty = true;
  }

  /** Take a whole picture. @param {ArrayLike<number>} values - Linear RGB by pixel. */
  fill(values) {
    this.values.set(values);
    this.#changed(this.whole);
  }

  /** @returns {Rectangle} */
  get whole() {
    return { x0: 0, y0: 0, x1: this.width, y1: this.height };
  }

  /**
   * Add a tile of a batch. Each value of a preview covers a block of `stride` x `stride` pixels.
   *
   * @param {Tile} tile
   */
  take(tile) {
    const place = clipped(tile, this.width, this.height);
    const { x0, y0, x1, y1 } = place;
    const { pixels, columns, stride } = tile;
    for (let y = y0; y < y1; y++) {
      const to = 3 * (y * this.width + x0);
      const source = 3 * columns * Math.floor((y - y0) / stride);
      if (stride === 1) this.values.set(pixels.subarray(source, source + 3 * (x1 - x0)), to);
      else spread(pixels, source, stride, this.values, to, x1 - x0);
    }
    this.#changed(place);
    return place;
  }

  /** The linear values of a pixel, or null while it is not known. @param {number} x @param {number} y */
  at(x, y) {
    const from = 3 * (y * this.width + x);
    return this.bits[from] === UNKNOWN ? null : Array.from(this.values.subarray(from, from + 3));
  }

  /** The luminance of each pixel; unknown pixels have the bits `UNKNOWN`. */
  get luminance() {
    if (!this.#luminance) {
      this.#luminance = new Float32Array(this.width * this.height);
      this.#weigh(this.whole);
    }
    return this.#luminance;
  }

  /** @param {Rectangle} place */
  #changed(place) {
    this.empty = false;
    if (this.#luminance) this.#weigh(place);
  }

  /** @param {Rectangle} place */
  #weigh({ x0, y0, x1, y1 }) {
    const { values, bits, width } = this;
    const sums = /** @type {Float32Array} */ (this.#luminance);
    const words = new Uint32Array(sums.buffer);
    for (let y = y0; y < y1; y++)
      for (let pixel = y * width + x0; pixel < y * width + x1; pixel++) {
        const from = 3 * pixel;
        if (bits[from] === UNKNOWN) words[pixel] = UNKNOWN;
        else sums[pixel] = luma(values[from], values[from + 1], values[from + 2]);
      }
  }
}

/**
 * @param {Float32Array} pixels
 * @param {number} source
 * @param {number} stride
 * @param {Float32Array} values
 * @param {number} to
 * @param {number} count
 */
function spread(pixels, source, stride, values, to, count) {
  for (let x = 0; x < count; x++, to += 3) {
    const from = source + 3 * Math.floor(x / stride);
    values[to] = pixels[from];
    values[to + 1] = pixels[from + 1];
    values[to + 2] = pixels[from + 2];
  }
}
