// A button that opens a small panel over everything else.

import { h } from "../../dom.js";

// The width of the panel and its least distance from the window's edge, CSS pixels.
const WIDTH = 288;
const MARGIN = 8;

/** A button and a panel, both to be put on the page. @param {string} label @param {string} id @param {import("../../dom.js").Child[]} content */
export function makePopover(label, id, ...content) {
  const button = h("button.opens", { popovertarget: id }, label);
  const panel = h("div.popover", { id, popover: "auto", "aria-label": label }, ...content);
  panel.addEventListener("beforetoggle", () => {
    const { bottom, right } = button.getBoundingClientRect();
    const most = innerWidth - WIDTH - MARGIN;
    panel.style.top = `${bottom + MARGIN / 2}px`;
    panel.style.right = `${Math.max(MARGIN, Math.min(most, innerWidth - right))}px`;
  });
  return { button, panel };
}
