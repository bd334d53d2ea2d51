// What each light and each ray adds to a pixel, as bars with numbers, and the shadow rays to the lights.

import { h } from "../../dom.js";
import { short } from "./numbers.js";

/**
 * @param {InspectedSurface} surface - What the ray hits.
 * @param {import("./shares.js").Part[]} parts - Of what it brings to the pixel.
 * @param {import("./ray.js").Links} links
 */
export function makeLights(surface, parts, links) {
  return h(
    "div",
    {},
    h(
      "table",
      { className: "parts" },
      h("caption", {}, "What this point adds to the pixel"),
      h(
        "thead",
        {},
        h(
          "tr",
          {},
          ["From", "Share of the pixel", "Linear"].map((name) => h("th", { scope: "col" }, name)),
        ),
      ),
      h("tbody", {}, parts.map(part)),
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

/** @param {import("./shares.js").Part} part */
function part({ name, color, share }) {
  return h(
    "tr",
    {},
    h("th", { scope: "row" }, name),
    h("td", {}, bar(share)),
    h("td", { className: "number" }, color.map(short).join("  ")),
  );
}

/** @param {number} share */
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

/** @param {InspectedLight} light @param {import("./ray.js").Links} links */
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
