// The outline of a shape on the picture, and the middle of a light.

import { add, cross, unit } from "./projection.js";

// Points on a circle of a sphere, and circles from pole to pole.
const AROUND = 64;
const RINGS = 32;

/** The corners of a rectangle of the scene. @param {RectangleDocument} rectangle */
function corners({ center, normal, tangent, size, corner, edges }) {
  if (corner && edges)
    return [corner, add(corner, edges[0]), add(add(corner, edges[0]), edges[1]), add(corner, edges[1])];
  const n = unit(normal);
  const bitangent = unit(cross(n, tangent));
  const across = unit(cross(bitangent, n));
  return [
    [-1, -1],
    [1, -1],
    [1, 1],
    [-1, 1],
  ].map(([u, v]) => add(add(center, across, (u * size[0]) / 2), bitangent, (v * size[1]) / 2));
}

/** @param {Extract<ShapeDocument, {type: "ellipsoid"}>} ellipsoid */
function onEllipsoid({ center, radius, axes }) {
  const [a, b, c] = axes ?? [
    [radius, 0, 0],
    [0, radius, 0],
    [0, 0, radius],
  ];
  return Array.from({ length: RINGS + 1 }, (_, i) => (Math.PI * i) / RINGS).flatMap((polar) =>
    Array.from({ length: AROUND }, (_, j) => (2 * Math.PI * j) / AROUND).map((turn) =>
      add(
        add(add(center, a, Math.sin(polar) * Math.cos(turn)), b, Math.sin(polar) * Math.sin(turn)),
        c,
        Math.cos(polar),
      ),
    ),
  );
}

/**
 * Points whose convex hull is the outline of a shape; none for meshes, which the page does not have.
 *
 * @param {ShapeDocument} shape
 * @returns {number[][]}
 */
function pointsOf(shape) {
  if (shape.type === "rectangle") return corners(shape);
  if (shape.type === "triangle") return shape.vertices;
  if (shape.type === "ellipsoid") return onEllipsoid(shape);
  return [];
}

/**
 * The outline of a shape as places on the picture; none if part of it is behind the camera.
 *
 * @param {ShapeDocument} shape
 * @param {import("./projection.js").Projection} projection
 */
export function outlineOf(shape, projection) {
  const places = pointsOf(shape).map((point) => projection.place(point));
  return places.every((place) => place !== null) ? hull(places) : [];
}

/** The convex hull of places, by Andrew's monotone chains. @param {PixelPlace[]} places */
function hull(places) {
  const sorted = [...places].sort((p, q) => p.x - q.x || p.y - q.y);
  /** @param {PixelPlace} o @param {PixelPlace} p @param {PixelPlace} q */
  const turn = (o, p, q) => (p.x - o.x) * (q.y - o.y) - (p.y - o.y) * (q.x - o.x);
  const chain = (/** @type {PixelPlace[]} */ points) => {
    /** @type {PixelPlace[]} */
    const kept = [];
    for (const point of points) {
      while (kept.length > 1 && turn(kept[kept.length - 2], kept[kept.length - 1], point) <= 0) kept.pop();
      kept.push(point);
    }
    return kept.slice(0, -1);
  };
  return [...chain(sorted), ...chain(sorted.reverse())];
}

/**
 * The middle of a light as seen from a point; far away for a directional one.
 *
 * @param {LightDocument} light
 * @param {number[]} from
 * @param {number} far
 */
export function middleOf(light, from, far) {
  if (light.type === "directional") return add(from, unit(light.direction), -far);
  if (light.type === "point" || light.type === "spot") return light.position;
  const points = corners(light);
  return [0, 1, 2].map((i) => points.reduce((sum, point) => sum + point[i] / points.length, 0));
}
