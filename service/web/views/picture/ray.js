// A ray of an inspection and its secondary rays, as nested lists.

import { h } from "../../dom.js";
import { makeLights } from "./lights.js";
import { short } from "./numbers.js";
import { colorBeyond, partsOf } from "./shares.js";

const KINDS = {
  camera: "Camera ray",
  mirror: "Mirrored ray",
  reflection: "Reflected ray",
  refraction: "Refracted ray",
};
// Deeper rays are collapsed: they usually add little.
const OPEN = 2;

/** @typedef {(pointers: string[]) => Node | ""} Links Makes buttons that show lines of the scene. */

/** @param {number[]} values */
const triple = (values) => values.map(short).join("  ");

/**
 * @param {InspectedRay} ray
 * @param {Links} links
 * @param {number} depth
 * @param {number[]} pixel - The colour of the whole pixel, that of the camera ray by default.
 * @returns {HTMLLIElement}
 */
export function makeRay(ray, links, depth, pixel = colorBeyond(ray)) {
  const { surface } = ray;
  const kind = KINDS[ray.kind];
  const hit = surface
    ? `hits ${surface.part.name ? `${surface.part.name}, ` : ""}shape ${surface.shape}`
    : ray.light
      ? `hits light ${ray.light.pointer.split("/").at(-1)}`
      : "hits only the background";
  const weight = ray.kind === "camera" ? "" : `, ${short(100 * ray.weight)} % of it reaches the camera`;
  return h(
    "li",
    {},
    h(
      "details",
      { open: depth <= OPEN },
      h("summary", {}, `${kind} ${hit}${weight}`),
      surface ? facts(surface, links) : h("p", { className: "number" }, `linear ${triple(ray.radiance)}`),
      surface ? makeLights(surface, partsOf(ray, surface, pixel, KINDS), links) : "",
      ray.rays.length
        ? h(
            "ol",
            { className: "rays" },
            ray.rays.map((next) => makeRay(next, links, depth + 1, pixel)),
          )
        : "",
    ),
  );
}

/** @param {InspectedSurface} surface @param {Links} links */
function facts(surface, links) {
  const bent = surface.normal.some((value, i) => value !== surface.shading_normal[i]);
  /** @type {([string, string | (string | Node)[]] | null | false)[]} */
  const rows = [
    [
      "shape",
      [
        `${surface.shape}${surface.primitive ? `, triangle ${surface.primitive}` : ""}`,
        links([surface.part.pointer]),
      ],
    ],
    ["distance", short(surface.t)],
    ["position", triple(surface.position)],
    ["u, v", triple(surface.uv)],
    ["normal", triple(surface.normal)],
    bent && ["shading normal", triple(surface.shading_normal)],
    ["material", [surface.material.name ?? "", links([surface.material.pointer])]],
    surface.texture && ["texture", [surface.texture.name ?? "", links([surface.texture.pointer])]],
    [surface.texture ? "texture value" : "colour", triple(surface.color)],
  ];
  return h(
    "dl",
    { className: "facts" },
    rows
      .flatMap((row) => (row ? [row] : []))
      .map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", { className: "number" }, value))),
  );
}
