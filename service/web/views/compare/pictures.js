// Pictures to compare, as linear floats, read from jobs and files.

import { jobPath, request } from "../../api.js";
import { Film } from "../picture/film.js";
import { decodeNpy } from "../picture/npy.js";
import { EIGHT_BITS, LINEAR, colorsOf } from "./references.js";

/** @import { Encoding } from "./references.js" */
/** @typedef {{film: Film, note: string, scene?: SceneDocument}} Read A picture, what to know of it, and its scene. */

/**
 * A film that holds a whole picture.
 *
 * @param {number} width
 * @param {number} height
 * @param {ArrayLike<number>} values - Linear RGB by pixel.
 */
function exposed(width, height, values) {
  const film = new Film(width, height);
  film.fill(values);
  return film;
}

/** @param {string} id @param {AbortSignal} signal */
export async function filmOfJob(id, signal) {
  const response = await request(`${jobPath(id)}/image.npy`, { signal });
  const { shape, values } = decodeNpy(await response.arrayBuffer());
  return exposed(shape[1], shape[0], values);
}

/**
 * The film of a file, as far as the page can read it by itself.
 *
 * @param {Blob} file
 * @param {Encoding} encoding
 * @returns {Promise<Read | null>} Null for a file that only the service can read.
 */
export async function filmOfFile(file, encoding) {
  const buffer = await file.arrayBuffer();
  const magic = new TextDecoder("latin1").decode(buffer.slice(0, 6));
  if (magic.slice(1, 4) === "PNG") return filmOfPng(file, encoding);
  if (magic.slice(1) !== "NUMPY") return null;
  try {
    const { width, height, values, note } = colorsOf(decodeNpy(buffer), encoding);
    return { film: exposed(width, height, values), note };
  } catch {
    // The service says what is wrong with it.
    return null;
  }
}

/** @param {Blob} file @param {Encoding} encoding */
async function filmOfPng(file, encoding) {
  const bitmap = await createImageBitmap(file, {
    colorSpaceConversion: "none",
    premultiplyAlpha: "none",
  }).catch(() => null);
  return bitmap && { film: filmOfCodes(pixelsOf(bitmap), encoding), note: EIGHT_BITS };
}

/** @param {ImageData} image @param {Encoding} encoding */
function filmOfCodes({ width, height, data }, encoding) {
  const values = new Float32Array(3 * width * height);
  for (let from = 0, to = 0; from < data.length; from += 4)
    for (let channel = 0; channel < 3; channel++, to++)
      values[to] = encoding === "linear" ? data[from + channel] / 255 : LINEAR[data[from + channel]];
  return exposed(width, height, values);
}

// Pixels between two pictures side by side.
const GAP = 4;

/**
 * B as the service has read it: the middle third of a picture of three side by side.
 *
 * @param {ComparisonDocument} answer
 * @param {Film} film - A.
 * @returns {Promise<Read>}
 */
export async function readByService({ images }, { width, height }) {
  if (!images) throw new Error("The service sent no pictures.");
  const bitmap = await bitmapOf(images.side_by_side, width + GAP, width, height);
  return { film: filmOfCodes(pixelsOf(bitmap), "srgb"), note: EIGHT_BITS };
}

/** @param {ImageBitmap} bitmap */
function pixelsOf(bitmap) {
  const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
  const context = /** @type {OffscreenCanvasRenderingContext2D} */ (
    canvas.getContext("2d", { willReadFrequently: true })
  );
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  return context.getImageData(0, 0, canvas.width, canvas.height);
}

/** A piece of a picture. @param {string} png @param {number} left @param {number} width @param {number} height */
function bitmapOf(png, left, width, height) {
  const blob = new Blob([Uint8Array.from(atob(png), (letter) => letter.charCodeAt(0))], {
    type: "image/png",
  });
  return createImageBitmap(blob, left, 0, width, height);
}

/** The content of a file in Base64. @param {Blob} file @returns {Promise<string>} */
export function encoded(file) {
  return new Promise((resolve, reject) => {
    const reader = new FileReader();
    reader.onload = () => resolve(String(reader.result).replace(/^.*?,/, ""));
    reader.onerror = () => reject(reader.error);
    reader.readAsDataURL(file);
  });
}
