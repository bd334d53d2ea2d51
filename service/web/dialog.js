// Modal questions.

import { h } from "./dom.js";

/**
 * Ask for confirmation of an action that cannot be undone.
 *
 * @param {string} question
 * @param {string} verb - Label of the button that confirms.
 * @returns {Promise<boolean>} Whether the user confirmed.
 */
export async function confirmed(question, verb) {
  const answer = await asked(
    question,
    h("button.danger", { type: "submit", value: "yes" }, verb),
    h("button", { type: "submit", autofocus: true }, "Keep it"),
  );
  return answer === "yes";
}

/** Say something that is to be read before going on. @param {string} text */
export async function notified(text) {
  await asked(text, h("button", { type: "submit", autofocus: true }, "OK"));
}

/** @param {string} text @param {HTMLButtonElement[]} buttons @returns {Promise<string>} The value of the pressed one. */
function asked(text, ...buttons) {
  return new Promise((resolve) => {
    /** @type {HTMLDialogElement} */
    const dialog = h(
      "dialog",
      { "aria-label": text, onclose: () => (dialog.remove(), resolve(dialog.returnValue)) },
      h("p", text),
      h("form.row", { method: "dialog" }, buttons),
    );
    document.body.append(dialog);
    dialog.showModal();
  });
}
