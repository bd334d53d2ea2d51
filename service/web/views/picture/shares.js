// What each part of an inspected pixel adds to its brightness.

import { luma } from "./transfer.js";

// A share up to this would be shown as 0.0 %.
const NOTHING = 0.0005;

/** @typedef {{name: string, color: number[], share: number}} Part `color` is what it adds to the pixel. */

/** @param {number[]} color */
const luminance = ([red, green, blue]) => luma(red, green, blue);

/**
 * The colour that a ray brings to the pixel, with all the rays that continue from where it ends.
 *
 * @param {InspectedRay} ray
 * @returns {number[]}
 */
export function colorBeyond({ weight, radiance, rays }) {
  const own = radiance.map((value) => weight * value);
  return rays.map(colorBeyond).reduce((sum, color) => sum.map((value, i) => value + color[i]), own);
}

/**
 * The parts of what a ray brings to the pixel, the largest first; where there is light, parts of nothing are left out.
 *
 * @param {InspectedRay} ray
 * @param {InspectedSurface} surface - That it hits.
 * @param {number[]} pixel - The colour of the whole pixel.
 * @param {Record<string, string>} kinds - Names of rays by their kind.
 * @returns {Part[]}
 */
export function partsOf(ray, surface, pixel, kinds) {
  const total = luminance(pixel);
  const reaching = (/** @type {number[]} */ color) => color.map((value) => ray.weight * value);
  const part = (/** @type {string} */ name, /** @type {number[]} */ color) => ({
    name,
    color,
    share: total > 0 ? luminance(color) / total : 0,
  });
  const parts = [
    part("Ambient light", reaching(surface.ambient)),
    ...surface.lights.flatMap(({ light, diffuse, specular }) => [
      part(`Light ${light}, diffuse`, reaching(diffuse)),
      part(`Light ${light}, highlight`, reaching(specular)),
    ]),
    ...ray.rays.map((next) => part(kinds[next.kind], colorBeyond(next))),
  ].sort((a, b) => b.share - a.share);
  return total > 0 ? parts.filter(({ share }) => share > NOTHING) : parts;
}
