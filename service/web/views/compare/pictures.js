// Pictures to compare, as linear floats, read from jobs and files.

import { jobPath, request } from "../../api.js";
import { Film } from "../picture/film.js";
import { decodeNpy } from "../picture/npy.js";

/** A film that holds a whole picture. @param {ArrayLike<number>} values - Linear RGB by pixel. */
export function exposed(width, height, values) {
  const film = new Film(width, height);
  film.values.set(values);
  film.known.fill(1);
  return film;
}

export async function filmOfJob(id, signal) {
  const response = await request(`${jobPath(id)}/image.npy`, { signal });
  const { shape, values } = decodeNpy(await response.arrayBuffer());
  return exposed(shape[1], shape[0], values);
}

// Pixels between two pictures side by side.
const GAP = 4;

const LINEAR = Float32Array.from({ length: 256 }, (_, code) => {
  const x = code / 255;
  return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
});

/** The third of a picture of three side by side that holds the reference, as the service has read it. */
export async function referenceIn(png, width, height) {
  const { data } = pixelsOf(await bitmapOf(png, width + GAP, 0, width, height));
  const values = new Float32Array(3 * width * height);
  for (let pixel = 0; pixel < width * height; pixel++) {
    for (let channel = 0; channel < 3; channel++)
      values[3 * pixel + channel] = LINEAR[data[4 * pixel + channel]];
  }
  return exposed(width, height, values);
}

function pixelsOf(bitmap) {
  const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  return context.getImageData(0, 0, canvas.width, canvas.height);
}

/** A picture, or a piece of it. @param {string} png - In Base64. */
export function bitmapOf(png, ...piece) {
  const blob = new Blob([Uint8Array.from(atob(png), (letter) => letter.charCodeAt(0))], {
    type: "image/png",
  });
  return createImageBitmap(blob, ...piece);
}

/** The content of a file in Base64. */
export function encoded(file) {
  return new Promise((resolve, reject) => {
    const reader = new FileReader();
    reader.onload = () => resolve(reader.result.slice(reader.result.indexOf(",") + 1));
    reader.onerror = () => reject(reader.error);
    reader.readAsDataURL(file);
  });
}
