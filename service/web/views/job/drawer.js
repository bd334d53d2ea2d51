// The drawer beside the picture: one tab at a time, so that nothing on the page scrolls away.

import { h } from "../../dom.js";

const KEYS = { ArrowRight: 1, ArrowLeft: -1 };

/** Events: `toggle` (it was opened or closed). */
export class Drawer extends EventTarget {
  /** @param {[string, string][]} tabs - Name and label of each. */
  constructor(tabs) {
    super();
    this.isOpen = true;
    this.tabs = new Map(tabs.map(([name, label]) => [name, this.#tab(name, label)]));
    this.panels = Object.fromEntries(
      tabs.map(([name]) => [
        name,
        h("div", {
          id: `panel-${name}`,
          className: `drawer-panel drawer-${name}`,
          role: "tabpanel",
          "aria-labelledby": `tab-${name}`,
          tabIndex: 0,
        }),
      ]),
    );
    this.element = h(
      "aside",
      { id: "drawer", className: "drawer", "aria-label": "Panel" },
      h(
        "div",
        {
          className: "drawer-tabs",
          role: "tablist",
          "aria-label": "Panel",
          onkeydown: (event) => this.#key(event),
        },
        [...this.tabs.values()],
      ),
      Object.values(this.panels),
    );
    this.#select(tabs[0][0]);
  }

  #tab(name, label) {
    return h(
      "button",
      {
        id: `tab-${name}`,
        type: "button",
        role: "tab",
        "aria-controls": `panel-${name}`,
        onclick: () => this.show(name),
      },
      label,
    );
  }

  #key(event) {
    const names = [...this.tabs.keys()];
    const step = KEYS[event.key];
    if (!step) return;
    event.preventDefault();
    const next = names[(names.indexOf(this.shown) + step + names.length) % names.length];
    this.show(next);
    this.tabs.get(next).focus();
  }

  #select(wanted) {
    this.shown = wanted;
    for (const [name, tab] of this.tabs) {
      tab.setAttribute("aria-selected", String(name === wanted));
      tab.tabIndex = name === wanted ? 0 : -1;
      this.panels[name].hidden = name !== wanted;
    }
  }

  /** Open the drawer at a tab. */
  show(name) {
    this.#select(name);
    if (!this.isOpen) this.toggle();
  }

  toggle() {
    this.isOpen = !this.isOpen;
    this.element.classList.toggle("closed", !this.isOpen);
    this.dispatchEvent(new Event("toggle"));
  }
}
