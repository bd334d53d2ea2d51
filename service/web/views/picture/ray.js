// A ray of an inspection and its secondary rays, as nested lists, with what lights add where they hit.

import { h } from "../../dom.js";
import { makeList, makeTable } from "../../elements.js";
import { percent } from "../../format.js";
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
const HEADINGS = ["From", "Share of the pixel", "Linear"];

/** @import { Part } from "./shares.js" */

/** @typedef {(pointers: string[]) => Node | ""} Links Makes buttons that show lines of the scene. */

/** @param {number[]} values */
const triple = (values) => values.map(short).join("  ");

/**
 * @param {InspectedRay} ray
 * @param {Links} links
 * @param {number} depth
 * @param {number[]} pixel - The colour of the whole pixel, that of the camera ray by default.
 * @returns {HTMLElement}
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
    "details",
    { open: depth <= OPEN },
    h("summary", `${kind} ${hit}${weight}`),
    surface ? facts(surface, links) : h("p.number", `linear ${triple(ray.radiance)}`),
    surface && makeLights(surface, partsOf(ray, surface, pixel, KINDS), links),
    makeList("ol.rays", ray.rays, (next) => makeRay(next, links, depth + 1, pixel)),
  );
}

/** @param {InspectedSurface} surface @param {Links} links */
function facts(surface, links) {
  const triangle = surface.primitive ? `, triangle ${surface.primitive}` : "";
  const bent = surface.normal.some((value, i) => value !== surface.shading_normal[i]);
  /** @type {([string, import("../../elements.js").Cell] | false | null)[]} */
  const rows = [
    ["shape", [`${surface.shape}${triangle}`, links([surface.part.pointer])]],
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
    "dl.facts",
    rows.map((row) => row && h("div", h("dt", row[0]), h("dd.number", row[1]))),
  );
}

/**
 * What each light and each ray adds to the pixel, as bars with numbers, and the shadow rays to the lights.
 *
 * @param {InspectedSurface} surface - What the ray hits.
 * @param {Part[]} parts - Of what it brings to the pixel.
 * @param {Links} links
 */
function makeLights(surface, parts, links) {
  return h(
    "div",
    makeTable(".parts", HEADINGS, parts.map(part), h("caption", "What this point adds to the pixel")),
    makeList("ul.shadows", surface.lights, (light) => shadow(light, links)),
  );
}

/** @param {Part} part */
const part = ({ name, color, share }) => [name, bar(share), h("td.number", color.map(short).join("  "))];

/** @param {number} share */
function bar(share) {
  const fill = h("span.amount-fill");
  fill.style.inlineSize = `${100 * share}%`;
  return h(
    "span.amount-row",
    h("span.amount", { "aria-hidden": "true" }, fill),
    h("span.number", percent(share, 1)),
  );
}

/** @param {InspectedLight} light @param {Links} links */
function shadow(light, links) {
  const rays = light.points === 1 ? "one shadow ray" : `${light.points} shadow rays`;
  const facts = [`${short(100 * light.visibility)} % visible`];
  if (light.below_horizon) facts.push(`${light.below_horizon} behind the surface`);
  return [
    h("p", `To light ${light.light}, ${rays}: ${facts.join(", ")}`, " ", links([light.pointer])),
    makeList("ul", light.blockers, ({ points, name, shape, pointer }) => [
      `${points} blocked by ${name ? `${name}, ` : ""}shape ${shape} `,
      links([pointer]),
    ]),
  ];
}
