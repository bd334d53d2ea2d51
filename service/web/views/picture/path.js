// The path of an inspected ray, drawn over the picture: where it continues, which lights it sees, and what blocks them.

import { middleOf, outlineOf } from "./outlines.js";
import { Projection, add } from "./projection.js";
import { strokeCased } from "./screen.js";

const CONTINUED = "#6fd0ff";
const SEEN = "#ffe27a";
const BLOCKED = "#ff7466";
const DOTS = [5, 5];
// Lines to lights are drawn from the surfaces of this many rays in a row.
const DEPTH = 2;
// What has no end is drawn so many times as long as the ray from the camera.
const FAR = 10;
// CSS pixels.
const END = 3.5;

export const MARKS =
  "On the picture, blue lines follow the ray, yellow ones lead to lights, dashed where a part is hidden, and red ones to " +
  "lights that are hidden completely. What blocks them is outlined in red.";

/** @typedef {{from: number[], to: number[], color: string, dashed: boolean}} Line */
/** @typedef {{blockers: Set<number>, lines: Line[]}} Gathered */

/** @param {SceneDocument} scene - As it was sent. */
export function makePath(scene) {
  const projection = new Projection(scene.camera);

  /**
   * Draw what was found.
   *
   * @param {CanvasRenderingContext2D} context
   * @param {PictureScreen} screen
   * @param {InspectionDocument} found
   */
  return function draw(context, screen, found) {
    const { surface } = found.ray;
    if (!surface) return;
    const { blockers, lines } = gathered(found.ray, scene, FAR * surface.t);
    for (const shape of blockers) outline(context, screen, outlineOf(scene.shapes[shape], projection));
    for (const { from, to, color, dashed } of lines) {
      const ends = projection.line(from, to);
      if (ends) line(context, screen, ends, color, dashed);
    }
  };
}

/**
 * The lines of a ray and of those that continue it, and the shapes that block its lights.
 *
 * @param {InspectedRay} ray
 * @param {SceneDocument} scene
 * @param {number} far
 * @param {number} depth
 * @param {Gathered} into
 */
function gathered(ray, scene, far, depth = 1, into = { blockers: new Set(), lines: [] }) {
  const { surface } = ray;
  if (ray.kind !== "camera")
    into.lines.push({ from: ray.origin, to: endOf(ray, far), color: CONTINUED, dashed: false });
  if (!surface || depth > DEPTH) return into;
  for (const light of surface.lights) {
    const hidden = light.visibility === 0;
    const to = middleOf(scene.lights[light.light], surface.position, far);
    into.lines.push({
      from: surface.position,
      to,
      color: hidden ? BLOCKED : SEEN,
      dashed: light.visibility < 1,
    });
    for (const { shape } of light.blockers) into.blockers.add(shape);
  }
  for (const next of ray.rays) gathered(next, scene, far, depth + 1, into);
  return into;
}

/** Where a ray ends: at what it hits, or far off if it hits no shape. @param {InspectedRay} ray @param {number} far */
const endOf = ({ origin, direction, surface }, far) => surface?.position ?? add(origin, direction, far);

/** @param {PictureScreen} screen @param {PixelPlace} place @returns {[number, number]} */
const seen = ({ left, top, scale }, { x, y }) => [left + scale * x, top + scale * y];

/**
 * @param {CanvasRenderingContext2D} context
 * @param {PictureScreen} screen
 * @param {[PixelPlace, PixelPlace]} ends
 * @param {string} color
 * @param {boolean} dashed
 */
function line(context, screen, [a, b], color, dashed) {
  const [x, y] = seen(screen, b);
  context.beginPath();
  context.moveTo(...seen(screen, a));
  context.lineTo(x, y);
  strokeCased(context, color, dashed ? DOTS : []);
  context.beginPath();
  context.arc(x, y, END, 0, 2 * Math.PI);
  context.fillStyle = color;
  context.fill();
}

/** @param {CanvasRenderingContext2D} context @param {PictureScreen} screen @param {PixelPlace[]} places */
function outline(context, screen, places) {
  if (places.length < 2) return;
  context.beginPath();
  for (const place of places) context.lineTo(...seen(screen, place));
  context.closePath();
  context.fillStyle = "rgb(255 80 64 / 22%)";
  context.fill();
  strokeCased(context, BLOCKED);
}
