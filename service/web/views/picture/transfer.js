// Converts linear light to 8-bit code values, exactly as in the PNG files of the service.

/** @type {Record<string, (x: number) => number>} From 0..1 to 0..1. */
export const TRANSFERS = {
  srgb: (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055),
  linear: (x) => x,
  "gamma 2.2": (x) => x ** (1 / 2.2),
};

/** Luminance (ITU-R BT.709). @param {number} red @param {number} green @param {number} blue */
export const luma = (red, green, blue) => 0.2126 * red + 0.7152 * green + 0.0722 * blue;

const float = new Float32Array(1);
const word = new Uint32Array(float.buffer);

/** @param {number} bits @returns {number} The float that has them. */
export function valueOf(bits) {
  word[0] = bits;
  return float[0];
}

/** @param {number} value @returns {number} The bits of the nearest float. */
export function bitsOf(value) {
  float[0] = value;
  return word[0];
}

/** Bits of infinity; those of NaN and of negative numbers are greater. */
export const INFINITE = bitsOf(Infinity);
// Table entries stand for floats whose first 17 bits are alike. They differ by at most 2^-8 of themselves, which is less
// than one code of 255 of any of these transfers: at most one code begins within an entry.
export const SHIFT = 15;
export const ENTRIES = 1 << (32 - SHIFT);
const NEVER = 0xffffffff;
const OPAQUE = 0xff000000;

/**
 * The code of a linear value; NaN is black.
 *
 * @param {number} value
 * @param {number} exposure
 * @param {string} transfer
 */
export function code(value, exposure, transfer) {
  const exposed = value * 2 ** exposure;
  const clipped = exposed > 0 ? Math.min(exposed, 1) : 0;
  return Math.floor(TRANSFERS[transfer](clipped) * 255 + 0.5);
}

/**
 * Bits of the least float whose code is at least `wanted`; bits of positive floats are ordered as they are.
 *
 * @param {number} wanted
 * @param {number} exposure
 * @param {string} transfer
 */
function least(wanted, exposure, transfer) {
  let low = 0;
  let high = INFINITE;
  while (high - low > 1) {
    const middle = Math.floor((low + high) / 2);
    if (code(valueOf(middle), exposure, transfer) >= wanted) high = middle;
    else low = middle;
  }
  return high;
}

/** A table that turns the bits of floats into codes. */
export class Encoder {
  /** @param {number} exposure - Stops. @param {string} transfer - A key of `TRANSFERS`. */
  constructor(exposure = 0, transfer = "srgb") {
    this.exposure = exposure;
    this.transfer = transfer;
    /** For each entry the code of its least float, and the bits from which on it is one more. */
    this.table = tableOf(exposure, transfer);
  }

  /** @param {number} value - Linear. */
  code(value) {
    return code(value, this.exposure, this.transfer);
  }

  /**
   * Write the colours of RGB pixels.
   *
   * @param {Uint32Array} bits - Of floats, RGB by pixel.
   * @param {number} from - The first of them.
   * @param {Uint32Array} packed - A word of RGBA codes for each pixel.
   * @param {number} to - The first of them.
   * @param {number} count - Pixels.
   */
  write(bits, from, packed, to, count) {
    const { table } = this;
    for (let i = 0; i < count; i++, from += 3, to++) {
      const red = bits[from];
      const green = bits[from + 1];
      const blue = bits[from + 2];
      const r = (red >>> SHIFT) << 1;
      const g = (green >>> SHIFT) << 1;
      const b = (blue >>> SHIFT) << 1;
      packed[to] =
        OPAQUE |
        ((table[b] + (blue >= table[b + 1] ? 1 : 0)) << 16) |
        ((table[g] + (green >= table[g + 1] ? 1 : 0)) << 8) |
        (table[r] + (red >= table[r + 1] ? 1 : 0));
    }
  }

  /**
   * Write one number of each pixel as grey; the parameters are those of `write`.
   *
   * @param {Uint32Array} bits
   * @param {number} from
   * @param {number} step - From the number of a pixel to that of the next.
   * @param {Uint32Array} packed
   * @param {number} to
   * @param {number} count
   */
  writeGrey(bits, from, step, packed, to, count) {
    const { table } = this;
    for (let i = 0; i < count; i++, from += step, to++) {
      const value = bits[from];
      const entry = (value >>> SHIFT) << 1;
      packed[to] = OPAQUE | (0x010101 * (table[entry] + (value >= table[entry + 1] ? 1 : 0)));
    }
  }
}

/** @param {number} exposure @param {string} transfer */
function tableOf(exposure, transfer) {
  const table = new Uint32Array(2 * ENTRIES);
  const end = INFINITE >>> SHIFT;
  let next = 0;
  for (let wanted = 1; wanted <= 256; wanted++) {
    const bits = wanted < 256 ? least(wanted, exposure, transfer) : INFINITE;
    const entry = bits >>> SHIFT;
    for (; next <= entry; next++) {
      table[2 * next] = wanted - 1;
      table[2 * next + 1] = NEVER;
    }
    if (wanted < 256) table[2 * entry + 1] = bits;
  }
  // Infinity is white; the entries after it are NaN and negative numbers.
  table[2 * end] = 255;
  for (let entry = end + 1; entry < ENTRIES; entry++) table[2 * entry + 1] = NEVER;
  return table;
}
