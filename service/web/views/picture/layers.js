// Layers: values of each pixel, as false colours with a scale.

import { GREY, named, pack, paletteOf, unpack } from "./colormaps.js";
import { scaleOf, steps } from "./scales.js";

const UNIT = new Set(["normal", "shading_normal"]);
const NAMES = new Set(["shape", "primitive"]);

/** @typedef {"directions" | "names" | "scale" | "colours"} Kind */

/** @param {string} name @param {number} channels @returns {Kind} */
function kindOf(name, channels) {
  if (UNIT.has(name)) return "directions";
  if (NAMES.has(name)) return "names";
  return channels === 1 || name === "error" ? "scale" : "colours";
}

/** The values of a layer, and their colours. */
export class Layer {
  /** @type {ArrayLike<number>} */
  #numbers;

  /**
   * @param {string} name
   * @param {number[]} shape - Height, width, and channels if there are several.
   * @param {import("./npy.js").Values} values
   * @param {import("./scales.js").Scale} [scale] - All finite values by default.
   */
  constructor(name, [height, width, channels = 1], values, scale) {
    this.name = name;
    this.height = height;
    this.width = width;
    this.channels = channels;
    this.values = values;
    this.kind = kindOf(name, channels);
    this.#numbers = this.kind === "scale" && channels > 1 ? worst(values, channels) : values;
    /** From which value to which the colours go; change it to have others. */
    this.scale = scale ?? scaleOf(this.kind === "scale" || this.kind === "colours" ? this.#numbers : []);
  }

  /** From which value to which its values go. @returns {import("./scales.js").Scale} */
  get range() {
    return this.kind === "directions" ? { ...this.scale, low: -1, high: 1 } : this.scale;
  }

  /** @param {number} x @param {number} y */
  at(x, y) {
    const from = this.channels * (y * this.width + x);
    return Array.from(this.values.subarray(from, from + this.channels));
  }

  /** The colour of a pixel. @param {number} x @param {number} y */
  codes(x, y) {
    const pixel = y * this.width + x;
    const packed = new Uint32Array(1);
    this.#write(packed, pixel, pixel + 1);
    return unpack(packed[0]);
  }

  /** Draw the whole layer. @param {ImageData} image - Of its size. */
  develop(image) {
    this.#write(new Uint32Array(image.data.buffer), 0, this.width * this.height);
    return image;
  }

  /** @param {Uint32Array} packed @param {number} begin @param {number} end */
  #write(packed, begin, end) {
    const { kind, values, scale, range } = this;
    if (kind === "scale") writeScale(packed, this.#numbers, scale, begin, end);
    else if (kind === "names") writeNames(packed, values, begin, end);
    else writeColors(packed, values, this.channels, range.low, range.high, begin, end);
  }
}

/** The greatest of the channels of each pixel. @param {ArrayLike<number>} values @param {number} channels */
function worst(values, channels) {
  const greatest = new Float32Array(values.length / channels);
  for (let pixel = 0, at = 0; pixel < greatest.length; pixel++) {
    let most = values[at++];
    for (let i = 1; i < channels; i++) most = Math.max(most, values[at++]);
    greatest[pixel] = most;
  }
  return greatest;
}

/**
 * @param {Uint32Array} packed
 * @param {ArrayLike<number>} numbers
 * @param {import("./scales.js").Scale} scale
 * @param {number} begin
 * @param {number} end
 */
function writeScale(packed, numbers, scale, begin, end) {
  const palette = paletteOf(scale.colors);
  const step = steps(scale, palette.length);
  for (let pixel = begin; pixel < end; pixel++) {
    const value = numbers[pixel];
    packed[pixel - begin] = Number.isFinite(value) ? palette[step(value)] : GREY;
  }
}

/** @param {Uint32Array} packed @param {ArrayLike<number>} values @param {number} begin @param {number} end */
function writeNames(packed, values, begin, end) {
  /** @type {Map<number, number>} */
  const known = new Map();
  let last = NaN;
  let color = 0;
  for (let pixel = begin; pixel < end; pixel++) {
    const value = values[pixel];
    if (value !== last) {
      color = known.get(value) ?? named(value);
      known.set(value, color);
      last = value;
    }
    packed[pixel - begin] = color;
  }
}

/**
 * @param {Uint32Array} packed
 * @param {ArrayLike<number>} values
 * @param {number} channels
 * @param {number} low
 * @param {number} high
 * @param {number} begin
 * @param {number} end
 */
function writeColors(packed, values, channels, low, high, begin, end) {
  const gain = 255 / (high - low || 1);
  const code = (/** @type {number} */ value) =>
    value > low ? (value < high ? Math.round((value - low) * gain) : 255) : 0;
  for (let pixel = begin, at = channels * begin; pixel < end; pixel++, at += channels) {
    packed[pixel - begin] = Number.isNaN(values[at])
      ? GREY
      : pack(code(values[at]), code(values[at + 1]), channels > 2 ? code(values[at + 2]) : 0);
  }
}
