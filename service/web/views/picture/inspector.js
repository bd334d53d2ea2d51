// Explains a pixel: the reasons for its colour, what its rays hit, and what each light adds.

import { jobPath, messageOf, post } from "../../api.js";
import { announce, h } from "../../dom.js";
import { makeList, makeTable, quoted } from "../../elements.js";
import { MARKS, makePath } from "./path.js";
import { makeRay } from "./ray.js";
import { short } from "./numbers.js";
import { makeSource } from "./source.js";

const HINT =
  "Click a pixel, or press Enter on it, to see what its ray hits and where its colour comes from. Escape removes its lines.";

/** @typedef {ReturnType<typeof makeInspector>} Inspector */

/**
 * @param {object} options
 * @param {string} options.id - Of the job.
 * @param {SceneDocument} options.scene - As it was sent.
 * @param {string} options.name - Of the picture among several, or empty.
 * @param {import("./film.js").Film} options.film
 * @param {(pixel: PixelPlace) => void} options.copy - Copies the values of a pixel.
 * @param {() => void} options.close - Removes pixel and lines from the picture.
 * @param {AbortSignal} options.signal
 */
export function makeInspector({ id, scene, name, film, copy, close, signal }) {
  const body = h("div");
  const heading = h("h2", { id: `inspector-title${name}` });
  const source = makeSource(id, name, signal);
  const element = h("section.inspector", { "aria-labelledby": heading.id, tabIndex: -1 }, heading, body);
  const drawPath = makePath(scene);
  /** @type {PixelPlace | null} */
  let wanted = null;
  /** @type {InspectionDocument | null} */
  let found = null;

  function clear() {
    wanted = found = null;
    heading.textContent = name ? `Why this colour of ${name}?` : "Why this colour?";
    body.replaceChildren(h("p.soft", HINT));
  }

  /** @param {PixelPlace} pixel */
  async function show(pixel) {
    wanted = pixel;
    found = null;
    body.setAttribute("aria-busy", "true");
    try {
      /** @type {InspectionDocument} */
      const answer = await post(`${jobPath(id)}/inspections`, pixel, { signal });
      if (wanted === pixel) fill((found = answer));
    } catch (error) {
      if (!signal.aborted) body.replaceChildren(h("p.problem", { role: "alert" }, messageOf(error)));
    }
    body.removeAttribute("aria-busy");
  }

  /** @param {InspectionDocument} found */
  function fill(found) {
    heading.textContent = `Pixel ${found.x}, ${found.y}${name && ` of ${name}`}`;
    const reasons = makeList("ul.reasons", found.reasons, ({ text, pointers }) => [
      h("p", quoted(text)),
      links(pointers),
    ]);
    body.replaceChildren(
      h(
        "div.explained",
        h(
          "div",
          reasons,
          colours(found, film.at(found.x, found.y)),
          h(
            "div.row",
            h("button", { onclick: () => copy({ x: found.x, y: found.y }) }, "Copy values"),
            h("button", { onclick: close }, "Remove lines"),
          ),
          source.element,
        ),
        h(
          "div",
          h("h3", "The ray and what it hits"),
          makeList("ol.rays", [found.ray], (ray) => makeRay(ray, links, 1)),
          found.ray.surface && h("p.soft.small", MARKS),
          !found.complete && h("p.soft.small", "Not all rays are listed."),
        ),
      ),
    );
    element.closest("[role=tabpanel]")?.scrollTo({ top: 0 });
    source.clear();
    announce(`Pixel ${found.x}, ${found.y}. ${found.reasons.map((reason) => reason.text).join(" ")}`);
  }

  /** @type {import("./ray.js").Links} */
  function links(pointers) {
    const buttons = pointers
      .filter(Boolean)
      .map((pointer) => h("button.plain.pointer", { onclick: () => source.show(pointer) }, pointer));
    return buttons.length ? h("span.pointers", buttons) : "";
  }

  clear();
  return {
    element,
    show,
    clear,
    /** Draw the path of the ray that is explained. @param {CanvasRenderingContext2D} context @param {PictureScreen} screen */
    draw(context, screen) {
      if (found) drawPath(context, screen, found);
    },
  };
}

/** @param {InspectionDocument} found @param {number[] | null} mean */
function colours(found, mean) {
  /** @type {[string, number[] | null][]} */
  const rows = [
    ["One ray through the centre", found.color],
    ["The picture, the mean of all samples", mean],
  ];
  const cells = rows.map(([name, values]) => [
    name,
    ...[0, 1, 2].map((i) => h("td.number", values ? short(values[i]) : "–")),
  ]);
  const caption = h("caption.unseen", "Linear colours");
  return makeTable(".colours", ["Linear", "red", "green", "blue"], cells, caption);
}
