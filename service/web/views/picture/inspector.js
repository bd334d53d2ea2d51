// Explains a pixel: the reasons for its colour, what its rays hit, and what each light adds.

import { jobPath, messageOf, post } from "../../api.js";
import { announce, h } from "../../dom.js";
import { quoted } from "../../elements.js";
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
  const element = h(
    "section",
    { className: "inspector", "aria-labelledby": heading.id, tabIndex: -1 },
    heading,
    body,
  );
  const drawPath = makePath(scene);
  /** @type {PixelPlace | null} */
  let wanted = null;
  /** @type {InspectionDocument | null} */
  let found = null;

  function clear() {
    wanted = found = null;
    heading.textContent = name ? `Why this colour of ${name}?` : "Why this colour?";
    body.replaceChildren(h("p", { className: "soft" }, HINT));
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
      if (!signal.aborted)
        body.replaceChildren(h("p", { className: "problem", role: "alert" }, messageOf(error)));
    }
    body.removeAttribute("aria-busy");
  }

  /** @param {InspectionDocument} found */
  function fill(found) {
    heading.textContent = `Pixel ${found.x}, ${found.y}${name && ` of ${name}`}`;
    const reasons = found.reasons.map(({ text, pointers }) =>
      h("li", {}, h("p", {}, quoted(text)), links(pointers)),
    );
    body.replaceChildren(
      h(
        "div",
        { className: "explained" },
        h(
          "div",
          {},
          h("ul", { className: "reasons" }, reasons),
          colours(found, film.at(found.x, found.y)),
          h(
            "div",
            { className: "row" },
            h("button", { type: "button", onclick: () => copy({ x: found.x, y: found.y }) }, "Copy values"),
            h("button", { type: "button", onclick: close }, "Remove lines"),
          ),
          source.element,
        ),
        h(
          "div",
          {},
          h("h3", {}, "The ray and what it hits"),
          h("ol", { className: "rays" }, makeRay(found.ray, links, 1)),
          found.ray.surface ? h("p", { className: "soft small" }, MARKS) : "",
          found.complete ? "" : h("p", { className: "soft small" }, "Not all rays are listed."),
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
      .map((pointer) =>
        h(
          "button",
          { type: "button", className: "plain pointer", onclick: () => source.show(pointer) },
          pointer,
        ),
      );
    return buttons.length ? h("span", { className: "pointers" }, buttons) : "";
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
  return h(
    "table",
    { className: "colours" },
    h("caption", { className: "unseen" }, "Linear colours"),
    h(
      "thead",
      {},
      h(
        "tr",
        {},
        ["Linear", "red", "green", "blue"].map((name) => h("th", { scope: "col" }, name)),
      ),
    ),
    h(
      "tbody",
      {},
      rows.map(([name, values]) =>
        h(
          "tr",
          {},
          h("th", { scope: "row" }, name),
          (values ?? [NaN, NaN, NaN]).map((value) =>
            h("td", { className: "number" }, values ? short(value) : "–"),
          ),
        ),
      ),
    ),
  );
}
