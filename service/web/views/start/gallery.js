// The gallery of example scenes.

import { get, request } from "../../api.js";
import { h, ofPage } from "../../dom.js";
import { assetNames } from "../../assets.js";

/**
 * @typedef {object} GalleryEntry
 * @property {string} name
 * @property {string} title
 * @property {string} notice
 * @property {number} width
 * @property {number} height
 */

/**
 * @param {(scene: OpenedScene) => void} onChoice
 * @param {AbortSignal} signal
 */
export function makeGallery(onChoice, signal) {
  const list = h("ul", { className: "gallery", "aria-label": "Gallery" });
  let wanted = "";

  /** Open an entry, unless another scene is opened before its files are here. @param {GalleryEntry} entry @returns {Promise<boolean>} Whether it is. */
  async function choose(entry) {
    wanted = entry.name;
    const scene = await fetched(entry, signal);
    if (wanted !== entry.name) return false;
    await onChoice(scene);
    return true;
  }

  /** Show which entry is open; none for a name that no entry has. @param {string} name */
  function press(name) {
    wanted = name;
    for (const button of list.querySelectorAll("button")) {
      button.setAttribute("aria-pressed", String(button.dataset.name === name));
    }
  }

  async function fill() {
    /** @type {GalleryEntry[]} */
    const entries = await get(ofPage("gallery.json"), { signal });
    list.replaceChildren(
      ...entries.map((entry) =>
        h(
          "li",
          {},
          card(entry, () => choose(entry)),
        ),
      ),
    );
    return entries;
  }

  return { element: list, fill, choose, press };
}

/** @param {GalleryEntry} entry @param {() => void} onclick */
function card({ name, title, width, height }, onclick) {
  const picture = h("img", {
    src: ofPage(`thumbnails/${name}.webp`),
    alt: "",
    width,
    height,
    loading: "lazy",
  });
  return h(
    "button",
    { type: "button", className: "card", "data-name": name, "aria-pressed": "false", onclick },
    picture,
    h("span", {}, title),
  );
}

/** @param {GalleryEntry} entry @param {AbortSignal} signal @returns {Promise<OpenedScene>} */
async function fetched({ name, title, notice }, signal) {
  const text = (await (await request(`/gallery/${name}.json`, { signal })).text()).trimEnd();
  const files = new Map();
  for (const asset of assetNames(JSON.parse(text)).keys()) {
    files.set(asset, await (await request(`/gallery/${asset}`, { signal })).blob());
  }
  return { title, notice, text, files, entry: name };
}
