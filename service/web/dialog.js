// Questions that stop everything else until they are answered.

import { h } from "./dom.js";

/**
 * Ask before something is done that cannot be undone.
 *
 * @param {string} question
 * @param {string} verb - What the button says that does it.
 * @returns {Promise<boolean>} Whether it shall be done.
 */
export function confirmed(question, verb) {
  return new Promise((resolve) => {
    const dialog = h(
      "dialog",
      { "aria-label": question, onclose: () => (dialog.remove(), resolve(dialog.returnValue === "yes")) },
      h("p", {}, question),
      h(
        "form",
        { method: "dialog", className: "row" },
        h("button", { value: "yes", className: "danger" }, verb),
        h("button", { value: "", autofocus: true }, "Keep it"),
      ),
    );
    document.body.append(dialog);
    dialog.showModal();
  });
}
