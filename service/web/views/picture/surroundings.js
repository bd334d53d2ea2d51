// What surrounds the picture: its background, and the whole display.

import { h } from "../../dom.js";
import { makeIcon } from "./icons.js";

const BACKGROUNDS = { grey: "Grey", black: "Black", white: "White", checks: "Checks" };
const KEPT = "penumbra:background";

/** A choice of what lies behind the picture, kept for the next one. */
export function makeBackground(stage) {
  const select = h(
    "select",
    { id: "background", onchange: () => (localStorage.setItem(KEPT, select.value), show()) },
    Object.entries(BACKGROUNDS).map(([value, name]) => h("option", { value }, name)),
  );
  const kept = localStorage.getItem(KEPT);
  if (kept in BACKGROUNDS) select.value = kept;
  const show = () => (stage.dataset.background = select.value);
  show();
  return h("div", { className: "field" }, h("label", { htmlFor: select.id }, "Background"), select);
}

/** A button that fills the display, where the browser can. */
export function makeFullscreen(viewer) {
  const toggle = () =>
    document.fullscreenElement ? document.exitFullscreen() : viewer.requestFullscreen().catch(() => {});
  return h(
    "button",
    {
      type: "button",
      className: "icon",
      title: "Full screen",
      "aria-label": "Full screen",
      hidden: !document.fullscreenEnabled,
      onclick: toggle,
    },
    makeIcon("fullscreen"),
  );
}
