// Statistics of a part of the picture, in a table.

import { announce, h } from "../../dom.js";
import { makeTable } from "../../elements.js";
import { plural } from "../../format.js";
import { short } from "./numbers.js";
import { hearRegion } from "./region.js";
import { statisticsOf } from "./statistics.js";

/** @typedef {import("./film.js").Rectangle} Rectangle */

const COLUMNS = /** @type {const} */ (["mean", "least", "greatest", "variance"]);
const NAMES = ["Red", "Green", "Blue"];

/**
 * @param {PictureScreen} screen
 * @param {() => {values: ArrayLike<number>, channels: number}} shown - What is on the screen.
 */
export function makeStatistics(screen, shown) {
  const hint = h("p.soft.small", "Drag with Shift over a part of the picture, or take");
  const button = (/** @type {string} */ label, /** @type {() => Rectangle} */ place) =>
    h("button", { onclick: () => (show(place()), announce(spoken())) }, label);
  const table = h("div.statistics");
  const remove = h("button", { hidden: true, onclick: removed }, "Remove");
  /** @type {Rectangle | null} */
  let region = null;

  /** @param {Rectangle} place */
  function show(place) {
    region = place;
    const { values, channels } = shown();
    table.replaceChildren(tableOf(place, statisticsOf(values, channels, screen.width, place)));
    remove.hidden = false;
    screen.redraw();
  }

  function clear() {
    region = null;
    table.replaceChildren();
    remove.hidden = true;
    screen.redraw();
  }

  function removed() {
    clear();
    screen.element.focus({ preventScroll: true });
  }

  const spoken = () => table.textContent ?? "";
  hearRegion(screen, show);
  return {
    element: h(
      "section.statistics-section",
      { "aria-label": "Statistics" },
      h("h3", "Statistics"),
      hint,
      h(
        "div.row",
        button("What is visible", () => screen.visible()),
        button("All of it", () => ({ x0: 0, y0: 0, x1: screen.width, y1: screen.height })),
        remove,
      ),
      table,
    ),
    /** @param {CanvasRenderingContext2D} context */
    draw(context) {
      if (region) screen.outline(context, region, "#4cc9f0");
    },
    clear,
    /** Another layer is shown, or the picture has changed. */
    changed() {
      if (region) show(region);
    },
  };
}

/** @param {Rectangle} place @param {import("./statistics.js").Statistics[]} channels */
function tableOf({ x0, y0, x1, y1 }, channels) {
  const pixels = (x1 - x0) * (y1 - y0);
  const infinite = channels.reduce((sum, { count }) => sum + pixels - count, 0);
  const rest = infinite ? `; ${plural(infinite, "value")} left out as infinite or without a number` : "";
  const name = (/** @type {number} */ i) => (channels.length === 1 ? "Value" : (NAMES[i] ?? `Channel ${i}`));
  const words = `Columns ${x0} to ${x1 - 1}, rows ${y0} to ${y1 - 1}: ${x1 - x0} × ${y1 - y0} pixels, linear${rest}`;
  const rows = channels.map((found, i) => [
    name(i),
    ...COLUMNS.map((column) => h("td.number", found.count ? short(found[column]) : "–")),
  ]);
  return makeTable("", ["", ...COLUMNS], rows, h("caption", words));
}
