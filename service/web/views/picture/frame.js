// The frame of a viewer: a toolbar, the picture to the edges of the window, and a drawer.

import { Problem, messageOf } from "../../api.js";
import { h } from "../../dom.js";
import { signInButton } from "../../session.js";
import { Drawer } from "./drawer.js";
import { makeIcon } from "./icons.js";

/** @typedef {ReturnType<typeof makeFrame>} Frame */

/**
 * Fill the window.
 *
 * @param {HTMLElement} root
 * @param {string} name - The heading.
 * @param {[string, string][]} tabs - Of the drawer: name and label of each.
 */
export function makeFrame(root, name, tabs) {
  const drawer = new Drawer(tabs);
  const state = h("div", { className: "bar-state" });
  const controls = h("div", { className: "bar-controls", role: "group", "aria-label": "Display" });
  const bar = h(
    "header",
    { className: "bar-top" },
    h("h1", { title: name }, name),
    state,
    controls,
    makeToggle(drawer),
  );
  const stage = h("section", { className: "stage", "aria-label": "Picture" });
  const viewer = h("div", { className: "viewer" }, bar, stage, drawer.element);
  document.body.classList.add("viewing");
  root.replaceChildren(viewer);
  const close = () => document.body.classList.remove("viewing");
  return { viewer, bar, state, controls, stage, drawer, close };
}

/** @param {Drawer} drawer */
function makeToggle(drawer) {
  const button = h(
    "button",
    {
      type: "button",
      className: "icon",
      title: "Show or hide the panel",
      "aria-label": "Panel",
      "aria-expanded": "true",
      "aria-controls": drawer.element.id,
      onclick: () => drawer.toggle(),
    },
    makeIcon("panel"),
  );
  drawer.addEventListener("toggle", () => button.setAttribute("aria-expanded", String(drawer.isOpen)));
  return button;
}

/** Say in place of a viewer why there is none. @param {HTMLElement} root @param {string} title @param {unknown} error */
export function refuse(root, title, error) {
  const isLocked = error instanceof Problem && (error.status === 401 || error.status === 403);
  root.replaceChildren(
    h("h1", {}, title),
    h("p", { className: "lead" }, messageOf(error)),
    isLocked ? signInButton() : "",
  );
}
