// Elements that several views share.

import { h } from "./dom.js";

/** Grey bars for content to come, as many as lines; they fade in, so that a fast answer shows none. @param {number} lines */
export function skeleton(lines) {
  return h(
    "div.skeleton",
    h("p.unseen", { role: "status" }, "Loading …"),
    Array.from({ length: lines }, () => h("span.bone", { "aria-hidden": "true" })),
  );
}

/**
 * An entry of a list of figures.
 *
 * @param {string} name
 * @param {string | Node} value
 * @param {string} rest - In small print; its line stays free where it is empty.
 */
export function figure(name, value, rest) {
  return h("div", h("dt", name), h("dd", h("strong", value), h("span.soft.small", rest || "\u00a0")));
}

/** @typedef {import("./dom.js").Child | import("./dom.js").Child[]} Children */
/** @typedef {string | Node | (string | Node)[]} Cell */

/**
 * A table, with a heading above each column if there are any.
 *
 * @param {string} classes - With a dot before each.
 * @param {string[]} headings
 * @param {Cell[][]} rows
 * @param {HTMLElement | null} [caption]
 */
export function makeTable(classes, headings, rows, caption) {
  const head = headings.map((name) => h("th", { scope: "col" }, name));
  return h(
    `table${classes}`,
    caption,
    head.length > 0 && h("thead", h("tr", head)),
    h("tbody", rows.map(makeRow)),
  );
}

/** Its heading, then the other cells. @param {Cell[]} cells */
const makeRow = ([first, ...cells]) =>
  h(
    "tr",
    h("th", { scope: "row" }, first),
    cells.map((cell) => (cell instanceof HTMLTableCellElement ? cell : h("td", cell))),
  );

/**
 * A list; nothing if it has no entries.
 *
 * @template Item
 * @param {`${"ol" | "ul"}${string}`} selector
 * @param {Item[]} items
 * @param {(item: Item, i: number) => Children} entry
 */
export function makeList(selector, items, entry) {
  const entries = items.map((item, i) => h("li", entry(item, i)));
  return entries.length > 0 && h(selector, entries);
}

/**
 * A choice among values, each with its label.
 *
 * @param {ElementProperties<HTMLSelectElement>} properties
 * @param {[string, string][]} choices
 * @param {string | null} [chosen]
 */
export function makeSelect(properties, choices, chosen) {
  const options = choices.map(([value, label]) => h("option", { value, selected: value === chosen }, label));
  return h("select", properties, options);
}

/** A control below its label. @param {string} label @param {HTMLElement} control @param {Node[]} more */
export const field = (label, control, ...more) =>
  h("div.field", h("label", { htmlFor: control.id }, label), control, ...more);

/** A text, with what is between backticks as code. @param {string} text @returns {(string | Node)[]} */
export const quoted = (text) => text.split("`").map((part, i) => (i % 2 ? h("code", part) : part));
