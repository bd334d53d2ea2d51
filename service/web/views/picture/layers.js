// Layers: values of each pixel, as false colours with a scale.

import { jobPath, request } from "../../api.js";
import { named, viridis } from "./colormaps.js";
import { decodeNpy } from "./npy.js";

const UNIT = new Set(["normal", "shading_normal"]);
const NAMES = new Set(["shape", "primitive"]);

/** @returns {Promise<Layer>} @throws {Problem} */
export async function fetchLayer(id, name, signal) {
  const response = await request(`${jobPath(id)}/layers/${name}.npy`, { signal });
  const { shape, values } = decodeNpy(await response.arrayBuffer());
  return new Layer(name, shape, values);
}

/** The values of a layer, and their colours. */
export class Layer {
  constructor(name, [height, width, channels = 1], values) {
    Object.assign(this, { name, height, width, channels, values });
    this.kind = UNIT.has(name)
      ? "directions"
      : NAMES.has(name)
        ? "names"
        : channels === 1 || name === "error"
          ? "scale"
          : "colours";
    [this.low, this.high] = this.kind === "scale" || this.kind === "colours" ? this.#range() : [0, 0];
  }

  at(x, y) {
    const from = this.channels * (y * this.width + x);
    return Array.from(this.values.subarray(from, from + this.channels));
  }

  develop() {
    const image = new ImageData(this.width, this.height);
    const color = this.#colors();
    for (let pixel = 0; pixel < this.width * this.height; pixel++) {
      const [r, g, b] = color(this.channels * pixel);
      image.data.set([r, g, b, 255], 4 * pixel);
    }
    return image;
  }

  #colors() {
    const { values, channels } = this;
    const share = (value) => Math.min(1, Math.max(0, (value - this.low) / (this.high - this.low || 1)));
    const grey = [128, 128, 128];
    if (this.kind === "names") return (at) => named(values[at]);
    if (this.kind === "directions") {
      return (at) =>
        Number.isNaN(values[at]) ? grey : [0, 1, 2].map((i) => Math.round(127.5 * (values[at + i] + 1)));
    }
    if (this.kind === "colours") {
      return (at) =>
        Number.isNaN(values[at])
          ? grey
          : [0, 1, 2].map((i) => (i < channels ? Math.round(255 * share(values[at + i])) : 0));
    }
    return (at) => {
      const value = this.#worst(at);
      return Number.isFinite(value) ? viridis[Math.round(255 * share(value))] : grey;
    };
  }

  /** The number to colour: the greatest of the channels. */
  #worst(at) {
    let worst = this.values[at];
    for (let i = 1; i < this.channels; i++) worst = Math.max(worst, this.values[at + i]);
    return worst;
  }

  #range() {
    let low = Infinity;
    let high = -Infinity;
    const step = this.kind === "scale" ? this.channels : 1;
    for (let at = 0; at < this.values.length; at += step) {
      const value = step === 1 ? this.values[at] : this.#worst(at);
      if (!Number.isFinite(value)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    return low <= high ? [low, high] : [0, 0];
  }
}
