// The view for an unknown address.

import { h } from "../dom.js";

export const title = "No such page";

/** @param {HTMLElement} root */
export function mount(root) {
  const jobs = h("a", { href: "/jobs" }, "jobs");
  const scene = h("a", { href: "/" }, "scene");
  if (/^\/compare(\/|$)/.test(location.pathname))
    root.append(
      h("h1", "Compare two pictures"),
      h("p.lead", "Choose two finished ", jobs, " and compare them."),
    );
  else
    root.append(
      h("h1", "There is no such page"),
      h("p.lead", "Try the list of ", jobs, ", or start with a ", scene, "."),
    );
}
