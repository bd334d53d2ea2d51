// The frame of a viewer: a toolbar, the picture to the edges of the window, and a drawer.

import { Problem, messageOf } from "../../api.js";
import { h } from "../../dom.js";
import { signInButton } from "../../session.js";
import { Drawer } from "./drawer.js";
import { makeIconButton } from "./icons.js";

/** @typedef {ReturnType<typeof makeFrame>} Frame */

/**
 * Fill the window.
 *
 * @param {HTMLElement} root
 * @param {string} name - The heading.
 * @param {[string, string][]} tabs - Of the drawer: name and label of each.
 * @param {AbortSignal} signal
 */
export function makeFrame(root, name, tabs, signal) {
  const drawer = new Drawer(tabs);
  const state = h("div.bar-state");
  const controls = h("div.bar-controls", { role: "group", "aria-label": "Display" });
  const heading = h("h1", { title: name }, name);
  const bar = h("header.bar-top", heading, state, controls, makeToggle(drawer));
  const stage = h("section.stage", { "aria-label": "Picture" });
  const viewer = h("div.viewer", bar, stage, drawer.element);
  document.body.classList.add("viewing");
  root.replaceChildren(viewer);
  signal.addEventListener("abort", () => document.body.classList.remove("viewing"));
  return { viewer, bar, heading, state, controls, stage, drawer };
}

/** @param {Drawer} drawer */
function makeToggle(drawer) {
  const button = makeIconButton("panel", {
    title: "Show or hide the panel",
    "aria-label": "Panel",
    "aria-expanded": "true",
    "aria-controls": drawer.element.id,
    onclick: () => drawer.toggle(),
  });
  drawer.addEventListener("toggle", () => button.setAttribute("aria-expanded", String(drawer.isOpen)));
  return button;
}

/** Say in place of a viewer why there is none. @param {HTMLElement} root @param {string} title @param {unknown} error */
export function refuse(root, title, error) {
  const isLocked = error instanceof Problem && (error.status === 401 || error.status === 403);
  root.replaceChildren(h("h1", title), h("p.lead", messageOf(error)), isLocked ? signInButton() : "");
}
