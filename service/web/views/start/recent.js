// Scenes that were written in this tab and left, newest first.

import { h } from "../../dom.js";
import { ago } from "../../format.js";
import { keepLarge, keptLarge } from "../../storage.js";
import { onService } from "./draft.js";

/** @import { Draft } from "./draft.js" */

const KEY = "penumbra-recent";
// As many as a panel shows at once; each may have some megabytes.
const MOST = 8;

/** @returns {Promise<(Draft & {at: string})[]>} */
const recentDrafts = async () => JSON.parse((await keptLarge(KEY)) ?? "[]");

/** Put a scene on the list; a browser without storage has none. @param {Draft} draft */
export async function remember(draft) {
  const others = (await recentDrafts()).filter(({ text }) => text !== draft.text);
  const list = [{ ...draft, at: new Date().toISOString() }, ...others].slice(0, MOST);
  await keepLarge(KEY, JSON.stringify(list)).catch(() => {});
}

/** @param {(scene: OpenedScene) => void} onChoice */
export function makeRecent(onChoice) {
  const list = h("ul", { className: "recent" });
  const element = h("section", { hidden: true }, h("h2", {}, "Recent scenes"), list);

  /** @param {Draft & {at: string}} draft */
  function entry(draft) {
    const open = () => onChoice({ ...draft, files: onService(draft.files) });
    return h(
      "li",
      {},
      h("button", { type: "button", className: "plain", onclick: open }, h("bdi", {}, draft.title)),
      h("span", { className: "soft small" }, ago(draft.at)),
    );
  }

  return {
    element,
    async fill() {
      const drafts = await recentDrafts();
      element.hidden = drafts.length === 0;
      list.replaceChildren(...drafts.map(entry));
    },
  };
}
