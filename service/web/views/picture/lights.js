// The contribution of each light to a point, and its shadow rays, as bars with numbers.

import { h } from "../../dom.js";
import { luma } from "./colors.js";
import { short } from "./numbers.js";

/** @param {object} ray @param {object} surface - What it hits. @param {(pointers: string[]) => Node} links */
export function makeLights(ray, surface, links) {
  const total = luma(...ray.radiance);
  const share = (color) => (total > 0 ? luma(...color) / total : 0);
  const rows = [part("Ambient light", surface.ambient, share(surface.ambient))];
  for (const light of surface.lights) {
    rows.push(part(`Light ${light.light}, diffuse`, light.diffuse, share(light.diffuse)));
    rows.push(part(`Light ${light.light}, highlight`, light.specular, share(light.specular)));
  }
  return h(
    "div",
    {},
    h(
      "table",
      { className: "parts" },
      h("caption", {}, "Light from this point"),
      h(
        "thead",
        {},
        h(
          "tr",
          {},
          ["From", "Share of brightness", "Linear"].map((name) => h("th", { scope: "col" }, name)),
        ),
      ),
      h("tbody", {}, rows),
    ),
    surface.lights.length
      ? h(
          "ul",
          { className: "shadows" },
          surface.lights.map((light) => shadow(light, links)),
        )
      : "",
  );
}

function part(name, color, share) {
  return h(
    "tr",
    {},
    h("th", { scope: "row" }, name),
    h("td", {}, bar(share)),
    h("td", { className: "number" }, color.map(short).join("  ")),
  );
}

function bar(share) {
  const fill = h("span", { className: "amount-fill" });
  fill.style.inlineSize = `${100 * share}%`;
  return h(
    "span",
    { className: "amount-row" },
    h("span", { className: "amount", "aria-hidden": "true" }, fill),
    h("span", { className: "number" }, `${(100 * share).toFixed(1)} %`),
  );
}

function shadow(light, links) {
  const rays = light.points === 1 ? "one shadow ray" : `${light.points} shadow rays`;
  const facts = [`${short(100 * light.visibility)} % visible`];
  if (light.below_horizon) facts.push(`${light.below_horizon} behind the surface`);
  return h(
    "li",
    {},
    h("p", {}, `To light ${light.light}, ${rays}: ${facts.join(", ")}`, " ", links([light.pointer])),
    light.blockers.length
      ? h(
          "ul",
          {},
          light.blockers.map((one) =>
            h(
              "li",
              {},
              `${one.points} blocked by ${one.name ? `${one.name}, ` : ""}shape ${one.shape} `,
              links([one.pointer]),
            ),
          ),
        )
      : "",
  );
}
