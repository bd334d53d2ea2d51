// Signs on buttons; the buttons have names of their own.

import { h, svg } from "../../dom.js";

// Lines on a square of 16.
const LINES = {
  panel: "M2 3h12v10H2zM10 3v10",
  link: "M7 5l2-2a2.8 2.8 0 0 1 4 4l-2 2M9 11l-2 2a2.8 2.8 0 0 1-4-4l2-2M6 10l4-4",
  done: "M3 8.5l3.5 3.5L13 4.5",
  fullscreen: "M2 6V2h4M10 2h4v4M14 10v4h-4M6 14H2v-4",
};

/** @param {keyof typeof LINES} name */
export function makeIcon(name) {
  return svg(
    "svg",
    { viewBox: "0 0 16 16", width: 16, height: 16, "aria-hidden": "true", class: "sign" },
    svg("path", { d: LINES[name] }),
  );
}

/** A button with a sign in place of its title. @param {keyof typeof LINES} name @param {ElementProperties<HTMLButtonElement>} properties */
export const makeIconButton = (name, properties) =>
  h("button.icon", { "aria-label": properties.title, ...properties }, makeIcon(name));
