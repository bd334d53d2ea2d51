// The view for an unknown address.

import { h } from "../dom.js";

export const title = "No such page";

/** @param {HTMLElement} root */
export function mount(root) {
  if (/^\/compare(\/|$)/.test(location.pathname)) return comparing(root);
  root.append(
    h("h1", {}, "There is no such page"),
    h(
      "p",
      { className: "lead" },
      "Try the list of ",
      h("a", { href: "/jobs" }, "jobs"),
      ", or start with a ",
      h("a", { href: "/" }, "scene"),
      ".",
    ),
  );
  return () => {};
}

/** @param {HTMLElement} root */
function comparing(root) {
  root.append(
    h("h1", {}, "Compare two pictures"),
    h(
      "p",
      { className: "lead" },
      "Choose two finished ",
      h("a", { href: "/jobs" }, "jobs"),
      " and compare them.",
    ),
  );
  return () => {};
}
