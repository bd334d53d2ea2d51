// Batches of tiles: their pixels, and how often they are asked for.

import { half } from "./views/picture/npy.js";

const HEAD = 20;
const TILE_HEAD = 32;
const FLOAT16 = 2;
/** Bytes of a pixel in half floats. */
export const PIXEL_BYTES = 6;

// A picture that is rendered is received again after so many times the seconds for which it has been watched, as early
// passes change the most: after a second at first, and after 40 s at the latest. Small ones come at this rate.
const TIMES = 2;
const FIRST_SECONDS = 1;
const LAST_SECONDS = 40;
const LEAST_RATE = 40e3;

/**
 * @typedef {import("./views/picture/film.js").Tile & {seq: number, pass: number, rows: number}} BatchedTile
 * @typedef {{next: number, complete: boolean, succeeded: boolean, tiles: BatchedTile[]}} Batch
 */

/** Bounds the bytes of the tiles of a running job: a watcher of 100 s takes at most some six pictures. */
export class Pace {
  /** @param {number} pixels - Of the picture. @param {number} now - Milliseconds. */
  constructor(pixels, now) {
    this.whole = PIXEL_BYTES * pixels;
    this.begun = now;
  }

  /** How long to wait before the next request, milliseconds. @param {number} bytes - Received. @param {number} now */
  after(bytes, now) {
    const seconds = (TIMES * (now - this.begun)) / 1000;
    const whole = Math.min(Math.max(seconds, FIRST_SECONDS), LAST_SECONDS);
    return 1000 * bytes * Math.min(whole / this.whole, 1 / LEAST_RATE);
  }
}

/** @type {Float32Array | undefined} */
let halves;

/** @param {ArrayBuffer} buffer @param {number} offset @param {number} length */
function fromHalves(buffer, offset, length) {
  const table = (halves ??= Float32Array.from({ length: 1 << 16 }, (_, bits) => half(bits)));
  return Float32Array.from(new Uint16Array(buffer, offset, length / 2), (bits) => table[bits]);
}

/**
 * Read a binary batch of tiles of linear RGB.
 *
 * @param {ArrayBuffer} buffer
 * @returns {Batch} Pixels in float32 are views into the buffer.
 */
export function decodeBatch(buffer) {
  const view = new DataView(buffer);
  const word = (/** @type {number} */ offset) => view.getUint32(offset, true);
  const encoding = view.getUint16(6, true);
  if (word(0) !== 0x424d4e50 || view.getUint16(4, true) !== 1 || ![0, FLOAT16].includes(encoding))
    throw new Error("This is not a batch of linear tiles.");
  const tiles = [];
  let offset = HEAD;
  for (let i = 0; i < word(8); i++) {
    const [seq, pass, x0, y0, x1, y1, stride, length] = Array.from({ length: 8 }, (_, k) =>
      word(offset + 4 * k),
    );
    offset += TILE_HEAD;
    const pixels =
      encoding === FLOAT16
        ? fromHalves(buffer, offset, length)
        : new Float32Array(buffer, offset, length / 4);
    const columns = Math.ceil((x1 - x0) / stride);
    const rows = Math.ceil((y1 - y0) / stride);
    tiles.push({ seq, pass, x0, y0, x1, y1, stride, columns, rows, pixels });
    offset += length;
  }
  const flags = word(16);
  return { next: word(12), complete: (flags & 1) !== 0, succeeded: (flags & 2) !== 0, tiles };
}
