// Controls of what is shown of a picture: one channel, an exposure that fits.

import { announce, h } from "../../dom.js";
import { field } from "../../elements.js";
import { exposureFor } from "./histogram.js";

/** @typedef {import("./develop.js").Developer} Developer @typedef {import("./look.js").Channel} Channel */

/** @type {[Channel, string][]} */
const NAMES = [
  ["rgb", "All"],
  ["red", "Red"],
  ["green", "Green"],
  ["blue", "Blue"],
  ["luminance", "Luminance"],
];

/**
 * A choice of the channel that is shown.
 *
 * @param {Developer} developer
 * @param {string | null} begun - The channel to begin with.
 * @param {() => void} changed
 */
export function makeChannels(developer, begun, changed) {
  /** @type {HTMLSelectElement} */
  const select = h(
    "select",
    { id: "shown-channel", onchange: () => (show(), changed()) },
    NAMES.map(([value, name]) => h("option", { value, selected: value === begun }, name)),
  );
  const show = () => developer.change({ channel: /** @type {Channel} */ (select.value) });
  if (select.selectedIndex > 0) show();
  return field("Channel", select);
}

/**
 * A button that chooses an exposure.
 *
 * @param {import("./film.js").Film} film
 * @param {(exposure: number) => void} expose
 */
export function makeAutoExposure(film, expose) {
  const title = "Expose so that the brightest 1 % of the pixels are white";
  function choose() {
    const exposure = exposureFor(film);
    if (exposure !== null) expose(exposure);
    announce(exposure === null ? "The picture is black." : `Exposure ${exposure} stops`);
  }
  return h("button", { type: "button", title, onclick: choose }, "Auto exposure");
}
