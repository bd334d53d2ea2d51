// The layers of a job, from the service.

import { jobPath, request } from "../../api.js";
import { Layer } from "./layers.js";
import { decodeNpy } from "./npy.js";

/** @returns {Promise<Layer>} @throws {Problem} */
export async function fetchLayer(id, name, signal) {
  const response = await request(`${jobPath(id)}/layers/${name}.npy`, { signal });
  const { shape, values } = decodeNpy(await response.arrayBuffer());
  return new Layer(name, shape, values);
}
