// Signs on buttons; the buttons have names of their own.

import { svg } from "../../dom.js";

// Lines on a square of 16.
const LINES = {
  panel: "M2 3h12v10H2zM10 3v10",
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
