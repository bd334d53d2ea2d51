// Explains a pixel: the reasons for its colour, what its rays hit, and what each light adds.

import { jobPath, messageOf, post } from "../../api.js";
import { announce, h } from "../../dom.js";
import { quoted } from "../../elements.js";
import { MARKS } from "./path.js";
import { makeRay } from "./ray.js";
import { short } from "./numbers.js";
import { makeSource } from "./source.js";

/**
 * @param {string} id - Of the job.
 * @param {(x: number, y: number) => number[] | null} pictured - The pixel of the picture.
 * @param {(pixel: PixelPlace) => void} copy - Copies its values.
 * @param {AbortSignal} signal
 */
export function makeInspector(id, pictured, copy, signal) {
  const body = h(
    "div",
    {},
    h(
      "p",
      { className: "soft" },
      "Click a pixel, or press Enter on it, to see what its ray hits and where its colour comes from.",
    ),
  );
  const heading = h("h2", { id: "inspector-title" }, "Why this colour?");
  const source = makeSource(id, signal);
  const element = h(
    "aside",
    { className: "inspector", "aria-labelledby": heading.id, tabIndex: -1 },
    heading,
    body,
  );
  /** @type {{pixel: PixelPlace | null, found: InspectionDocument | null}} */
  const state = { pixel: null, found: null };
  const self = Object.assign(state, { element, show });

  /** @param {PixelPlace} pixel */
  async function show(pixel) {
    self.pixel = pixel;
    self.found = null;
    body.setAttribute("aria-busy", "true");
    try {
      /** @type {InspectionDocument} */
      const found = await post(`${jobPath(id)}/inspections`, pixel, { signal });
      if (self.pixel === pixel) fill(found);
    } catch (error) {
      if (!signal.aborted)
        body.replaceChildren(h("p", { className: "problem", role: "alert" }, messageOf(error)));
    }
    body.removeAttribute("aria-busy");
  }

  /** @param {InspectionDocument} found */
  function fill(found) {
    self.found = found;
    heading.textContent = `Pixel ${found.x}, ${found.y}`;
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
          colours(found, pictured(found.x, found.y)),
          h("button", { type: "button", onclick: () => copy({ x: found.x, y: found.y }) }, "Copy values"),
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
    element.parentElement?.scrollTo({ top: 0 });
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

  return self;
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
