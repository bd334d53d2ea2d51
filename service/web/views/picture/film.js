// The picture received so far, as linear floats.

import { Encoder } from "./transfer.js";

const clipped = (tile, width, height) => ({
  x0: Math.min(tile.x0, width),
  y0: Math.min(tile.y0, height),
  x1: Math.min(tile.x1, width),
  y1: Math.min(tile.y1, height),
});

export class Film {
  constructor(width, height) {
    this.width = width;
    this.height = height;
    this.values = new Float32Array(3 * width * height);
    this.bits = new Uint32Array(this.values.buffer);
    this.known = new Uint8Array(width * height);
    this.encoder = new Encoder();
  }

  /** Add a tile of a batch. Each value of a preview covers a block of `stride` x `stride` pixels. */
  take(tile) {
    const place = clipped(tile, this.width, this.height);
    const { x0, y0, x1, y1 } = place;
    const { pixels, columns, stride } = tile;
    const count = x1 - x0;
    for (let y = y0; y < y1; y++) {
      const pixel = y * this.width + x0;
      const source = 3 * columns * Math.floor((y - y0) / stride);
      if (stride === 1) this.values.set(pixels.subarray(source, source + 3 * count), 3 * pixel);
      else spread(pixels, source, stride, this.values, 3 * pixel, count);
      this.known.fill(1, pixel, pixel + count);
    }
    return place;
  }

  /** The linear values of a pixel, or null while it is not known. */
  at(x, y) {
    const pixel = y * this.width + x;
    return this.known[pixel] ? Array.from(this.values.subarray(3 * pixel, 3 * pixel + 3)) : null;
  }

  /** Encode a rectangle; unknown pixels stay transparent. */
  develop({ x0, y0, x1, y1 }) {
    const image = new ImageData(x1 - x0, y1 - y0);
    for (let y = y0; y < y1; y++) {
      const from = y * this.width + x0;
      const to = 4 * (y - y0) * (x1 - x0);
      this.encoder.write(this.bits, 3 * from, image.data, to, x1 - x0);
      for (let i = 0; i < x1 - x0; i++) if (!this.known[from + i]) image.data[to + 4 * i + 3] = 0;
    }
    return image;
  }
}

function spread(pixels, source, stride, values, to, count) {
  for (let x = 0; x < count; x++, to += 3) {
    const from = source + 3 * Math.floor(x / stride);
    values[to] = pixels[from];
    values[to + 1] = pixels[from + 1];
    values[to + 2] = pixels[from + 2];
  }
}
