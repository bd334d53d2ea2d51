// Copies text, also where the browser offers no clipboard: it does so only on secure addresses.

import { h } from "../../dom.js";

/** @returns {Promise<boolean>} Whether the text is on the clipboard. */
export async function copied(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const area = h("textarea", { className: "unseen", value: text, readOnly: true });
    const focused = document.activeElement;
    document.body.append(area);
    area.select();
    const done = document.execCommand("copy");
    area.remove();
    focused?.focus({ preventScroll: true });
    return done;
  }
}
