// Converts linear light to 8-bit code values, exactly as in the PNG files of the service.

/** @type {Record<string, (x: number) => number>} From 0..1 to 0..1. */
export const TRANSFERS = {
  srgb: (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055),
  linear: (x) => x,
  "gamma 2.2": (x) => x ** (1 / 2.2),
};

const float = new Float32Array(1);
const word = new Uint32Array(float.buffer);

function valueOf(bits) {
  word[0] = bits;
  return float[0];
}

function bitsOf(value) {
  float[0] = value;
  return word[0];
}

const INFINITE = bitsOf(Infinity);
// Table entries stand for floats whose first 17 bits are alike. They differ by at most 2^-8 of themselves, which is less
// than one code of 255 of any of these transfers: at most one code begins within an entry.
const SHIFT = 15;
const ENTRIES = 1 << (32 - SHIFT);
const NEVER = 0xffffffff;

/** The code of a linear value; NaN is black. */
export function code(value, exposure, transfer) {
  const exposed = value * 2 ** exposure;
  const clipped = exposed > 0 ? Math.min(exposed, 1) : 0;
  return Math.floor(TRANSFERS[transfer](clipped) * 255 + 0.5);
}

/** Bits of the least float whose code is at least `wanted`; bits of positive floats are ordered as they are. */
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

/**
 * Tables that turn floats into codes.
 *
 * @param {number} exposure - Stops. @param {string} transfer - A key of `TRANSFERS`.
 */
export class Encoder {
  #first = new Uint8Array(ENTRIES);
  #next = new Uint32Array(ENTRIES).fill(NEVER);

  constructor(exposure = 0, transfer = "srgb") {
    this.exposure = exposure;
    this.transfer = transfer;
    const end = INFINITE >>> SHIFT;
    for (let wanted = 1; wanted <= 255; wanted++) {
      const bits = least(wanted, exposure, transfer);
      const entry = bits >>> SHIFT;
      this.#next[entry] = bits;
      this.#first.fill(wanted, entry + 1, end + 1);
    }
    // Infinity is white; the entries after it are NaN and negative numbers.
    this.#first[end] = 255;
  }

  /**
   * Write the codes of pixels.
   *
   * @param {Uint32Array} bits - Of floats, RGB by pixel. @param {number} from - The first of them.
   * @param {Uint8ClampedArray} rgba - Codes, RGBA by pixel. @param {number} to - The first of them.
   * @param {number} count - Pixels.
   */
  write(bits, from, rgba, to, count) {
    const first = this.#first;
    const next = this.#next;
    for (let i = 0; i < count; i++, from += 3, to += 4) {
      for (let channel = 0; channel < 3; channel++) {
        const value = bits[from + channel];
        const entry = value >>> SHIFT;
        rgba[to + channel] = first[entry] + (value >= next[entry] ? 1 : 0);
      }
      rgba[to + 3] = 255;
    }
  }
}
