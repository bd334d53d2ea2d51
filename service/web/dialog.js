// Modal questions.

import { h } from "./dom.js";

/**
 * Ask for confirmation of an action that cannot be undone.
 *
 * @param {string} question
 * @param {string} verb - Label of the button that confirms.
 * @returns {Promise<boolean>} Whether the user confirmed.
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
