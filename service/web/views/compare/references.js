// Linear colours from the numbers of a reference file, as the service reads them.

/** @typedef {"srgb" | "linear" | ""} Encoding What the numbers of a file mean; "" for what is usual in its format. */

/** @param {number} x - sRGB, 0 to 1. @returns {number} Linear. */
const linearOf = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);

/** Linear values of sRGB codes of 8 bits. */
export const LINEAR = Float32Array.from({ length: 256 }, (_, code) => linearOf(code / 255));

export const EIGHT_BITS = "B is shown with 8 bits a channel and nothing outside 0 to 1.";

/** @type {Record<string, number>} The greatest whole number of a type. */
const LARGEST = { u1: 255, u2: 65535 };

/**
 * The picture in an array: grey or RGB; an alpha channel is left out, as the service accepts none that hides anything.
 *
 * @param {import("../picture/npy.js").NpyArray} array
 * @param {Encoding} encoding
 * @returns {{width: number, height: number, values: Float32Array, note: string}} Linear RGB by pixel, and what to know
 *   about it.
 * @throws {Error} If it is no picture.
 */
export function colorsOf({ shape, values: numbers, type }, encoding) {
  const [height, width, channels = 1] = shape;
  if (shape.length < 2 || shape.length > 3 || channels > 4)
    throw new Error(`An array of shape (${shape.join(", ")}) is not a picture.`);
  const largest = LARGEST[type] ?? 1;
  const colored = channels > 2 ? 1 : 0;
  const values = new Float32Array(3 * width * height);
  for (let pixel = 0, to = 0; pixel < width * height; pixel++)
    for (let channel = 0; channel < 3; channel++, to++) {
      const value = numbers[channels * pixel + colored * channel] / largest;
      values[to] = encoding === "srgb" ? linearOf(value) : value;
    }
  return { width, height, values, note: noteOn(type) };
}

/** @param {string} type */
function noteOn(type) {
  if (type === "u1") return EIGHT_BITS;
  if (type === "u2") return "B is shown with nothing outside 0 to 1.";
  return type === "f8" ? "B has float64 values, shown as float32." : "";
}
