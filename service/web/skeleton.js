// What stands in the place of content that is still on its way.

import { h } from "./dom.js";

/** Grey bars in the place of so many lines; they fade in, so that a fast answer shows none. */
export function skeleton(lines) {
  return h(
    "div",
    { className: "skeleton" },
    h("p", { className: "unseen", role: "status" }, "Loading …"),
    Array.from({ length: lines }, () => h("span", { className: "bone", "aria-hidden": "true" })),
  );
}
