// Elements that several views share.

import { h } from "./dom.js";

/** Grey bars for content to come, as many as lines; they fade in, so that a fast answer shows none. @param {number} lines */
export function skeleton(lines) {
  return h(
    "div",
    { className: "skeleton" },
    h("p", { className: "unseen", role: "status" }, "Loading …"),
    Array.from({ length: lines }, () => h("span", { className: "bone", "aria-hidden": "true" })),
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
  return h(
    "div",
    {},
    h("dt", {}, name),
    h("dd", {}, h("strong", {}, value), h("span", { className: "soft small" }, rest || "\u00a0")),
  );
}

/** A control below its label. @param {string} label @param {HTMLElement} control @param {Node[]} more */
export const field = (label, control, ...more) =>
  h("div", { className: "field" }, h("label", { htmlFor: control.id }, label), control, ...more);

/** A text, with what is between backticks as code. @param {string} text @returns {(string | Node)[]} */
export const quoted = (text) => text.split("`").map((part, i) => (i % 2 ? h("code", {}, part) : part));
