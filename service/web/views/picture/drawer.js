// The drawer beside the picture: one tab at a time, so that nothing on the page scrolls away.

import { h } from "../../dom.js";

/** @type {Record<string, number>} */
const KEYS = { ArrowRight: 1, ArrowLeft: -1 };

/** Events: `toggle` (it was opened or closed), `change` (another tab is shown). */
export class Drawer extends EventTarget {
  /** @param {[string, string][]} tabs - Name and label of each. */
  constructor(tabs) {
    super();
    this.first = tabs[0][0];
    /** The name of the tab that is shown. */
    this.shown = this.first;
    this.isOpen = true;
    this.tabs = new Map(tabs.map(([name, label]) => [name, this.#tab(name, label)]));
    /** @type {Record<string, HTMLElement>} */
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
      "aside.drawer",
      { id: "drawer", "aria-label": "Panel" },
      h(
        "div.drawer-tabs",
        {
          role: "tablist",
          "aria-label": "Panel",
          onkeydown: (event) => this.#key(event),
        },
        [...this.tabs.values()],
      ),
      Object.values(this.panels),
    );
    this.#select(this.first);
  }

  /** @param {string} name @param {string} label */
  #tab(name, label) {
    return h(
      "button",
      {
        id: `tab-${name}`,
        role: "tab",
        "aria-controls": `panel-${name}`,
        onclick: () => this.show(name),
      },
      label,
    );
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const names = [...this.tabs.keys()];
    const step = KEYS[event.key];
    if (!step) return;
    event.preventDefault();
    const next = names[(names.indexOf(this.shown) + step + names.length) % names.length];
    this.show(next);
    this.tabs.get(next)?.focus();
  }

  /** @param {string} wanted */
  #select(wanted) {
    this.shown = wanted;
    for (const [name, tab] of this.tabs) {
      tab.setAttribute("aria-selected", String(name === wanted));
      tab.tabIndex = name === wanted ? 0 : -1;
      this.panels[name].hidden = name !== wanted;
    }
    this.dispatchEvent(new Event("change"));
  }

  /** Open the drawer at a tab. @param {string} name */
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
