// The panels of the start page: what can be opened, and help.

import { h } from "../../dom.js";
import { chosen, unpacked } from "../../drop.js";

const KEYS = [
  ["Ctrl + Enter", "render"],
  ["Ctrl + F", "search"],
  ["Ctrl + Space", "list the fields or values that fit; Tab or Enter takes one"],
  ["Ctrl + I", "explain the field at the cursor"],
  ["F8", "go to the next problem"],
  ["Tab", "leave the editor, where no list is open"],
];

/** @param {string} label @param {Node[]} content */
function makePanel(label, ...content) {
  const id = `${label.split(" ")[0].toLowerCase()}-panel`;
  return {
    button: h("button", { type: "button", popovertarget: id }, label),
    panel: h("div", { id, className: "start-panel", popover: "auto", "aria-label": label }, ...content),
  };
}

/**
 * Files, scenes written before, and the gallery.
 *
 * @param {(files: Map<string, File>) => void} onFiles
 * @param {ReturnType<typeof import("./recent.js").makeRecent>} recent
 * @param {HTMLElement} gallery
 */
export function openingPanel(onFiles, recent, gallery) {
  /** @type {HTMLInputElement} */
  const picker = h("input", {
    type: "file",
    multiple: true,
    className: "unseen",
    onchange: async () => {
      const files = chosen(picker.files);
      picker.value = "";
      onFiles(await unpacked(files));
    },
  });
  const made = makePanel(
    "Open a scene",
    h(
      "div",
      { className: "row" },
      h("label", { className: "button" }, picker, "Open files …"),
      h(
        "p",
        { className: "soft small" },
        "Or drop a scene with its textures and meshes, or a ZIP of them, anywhere on this page.",
      ),
    ),
    recent.element,
    h("h2", {}, "Examples"),
    gallery,
  );
  made.panel.addEventListener("beforetoggle", recent.fill);
  return made;
}

export const helpPanel = () =>
  makePanel(
    "Help",
    h("p", {}, "Hold the pointer over a field of the scene to read what it means."),
    h(
      "dl",
      { className: "keys" },
      KEYS.map(([keys, action]) => h("div", {}, h("dt", {}, h("kbd", {}, keys)), h("dd", {}, action))),
    ),
    h(
      "p",
      {},
      h("a", { href: "/v1/schemas/scene.json", target: "_blank" }, "All fields of scenes, a JSON Schema"),
    ),
    h("p", {}, h("a", { href: "/docs", target: "_blank" }, "All calls of the service")),
  );
