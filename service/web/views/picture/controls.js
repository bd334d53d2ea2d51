// Controls of the viewer: layer, channel, exposure, transfer function, zoom, background, full screen.

import { announce, h } from "../../dom.js";
import { field, makeSelect } from "../../elements.js";
import { keep, kept } from "../../storage.js";
import { exposureFor } from "./histogram.js";
import { makeIcon, makeIconButton } from "./icons.js";
import { copied } from "./readout.js";
import { TRANSFERS } from "./transfer.js";

/** @typedef {import("./develop.js").Developer} Developer @typedef {import("./look.js").Channel} Channel */

const WORDS = { srgb: "sRGB", linear: "Linear", "gamma 2.2": "Gamma 2.2" };
const MOST_STOPS = 10;

/** The display settings of a scene. @param {Pick<SceneDocument, "display">} scene @returns {DisplaySettings} */
export const displayOf = (scene) => ({ exposure: 0, transfer: "srgb", ...scene.display });

/** Controls of exposure and transfer function. @param {() => void} changed */
export function makeDisplay(changed) {
  const exposure = h("input", {
    id: "display-exposure",
    type: "range",
    min: -MOST_STOPS,
    max: MOST_STOPS,
    step: 0.25,
    value: 0,
    oninput: update,
  });
  const stops = h("output", { htmlFor: exposure.id });
  const transfer = makeSelect({ id: "display-transfer", onchange: changed }, Object.entries(WORDS));
  const scene = { exposure: 0, transfer: "srgb" };
  const reset = h(
    "button.plain",
    { title: "Use the settings of the scene", onclick: () => set(scene) },
    "Reset",
  );

  function update() {
    const value = Number(exposure.value);
    stops.textContent =
      `${value > 0 ? "+" : ""}${value}`.replace("-", "−") + (Math.abs(value) === 1 ? " stop" : " stops");
    exposure.setAttribute("aria-valuetext", stops.textContent);
    changed();
  }

  /** @param {DisplaySettings} values */
  function set(values) {
    // Otherwise the slider rounds the exposure of the scene to its steps.
    exposure.step = Number.isInteger(4 * values.exposure) ? "0.25" : "any";
    exposure.min = String(Math.min(-MOST_STOPS, values.exposure));
    exposure.max = String(Math.max(MOST_STOPS, values.exposure));
    exposure.value = String(values.exposure);
    transfer.value = values.transfer;
    update();
  }

  return {
    element: h("div.display", field("Exposure", exposure, stops), field("Transfer", transfer), reset),
    get exposure() {
      return Number(exposure.value);
    },
    get transfer() {
      return transfer.value;
    },
    /** Change some of the settings. @param {Partial<DisplaySettings>} values */
    set: (values) => set({ exposure: Number(exposure.value), transfer: transfer.value, ...values }),
    /** Begin with the settings of the scene, but for those in an address. @param {DisplaySettings} values @param {URLSearchParams} asked */
    begin(values, asked) {
      Object.assign(scene, values);
      const stops = Number(asked.get("exposure") || NaN);
      const name = asked.get("transfer") ?? "";
      set({
        exposure: Number.isFinite(stops) ? stops : values.exposure,
        transfer: Object.hasOwn(TRANSFERS, name) ? name : values.transfer,
      });
    },
    /** The settings for an address; null for those of the scene. */
    get asked() {
      return {
        exposure: Number(exposure.value) === scene.exposure ? null : exposure.value,
        transfer: transfer.value === scene.transfer ? null : transfer.value,
      };
    },
  };
}

/**
 * A list of what can be shown.
 *
 * @param {[string, string][]} choices - Name and label of each.
 * @param {(name: string) => void} changed
 */
export function makeChoice(choices, changed) {
  /** @type {HTMLSelectElement} */
  const select = makeSelect({ id: "shown-layer", onchange: () => changed(select.value) }, choices);
  return { element: field("Shown", select), select };
}

/**
 * Buttons that zoom a screen, around the zoom itself: 100 % shows a pixel of the picture as one of the display.
 *
 * @param {PictureScreen} screen
 */
export function makeZoom(screen) {
  /** @param {string} label @param {string} title @param {() => void} onclick @param {string} [name] */
  const button = (label, title, onclick, name) => h("button", { title, "aria-label": name, onclick }, label);
  const zoom = h("output.number", { title: "Zoom", "aria-label": "Zoom" });
  const show = () => (zoom.textContent = `${short(100 * screen.zoomed)} %`);
  screen.on("view", show);
  return h(
    "div.zoom",
    { role: "group", "aria-label": "Zoom" },
    button("−", "Zoom out", () => screen.zoom(screen.scale / 2), "Zoom out"),
    zoom,
    button("+", "Zoom in", () => screen.zoom(screen.scale * 2), "Zoom in"),
    button("1:1", "A pixel of the picture as one of the display", () => screen.zoom(1 / devicePixelRatio)),
    button("Fit", "Show the whole picture", () => screen.fit()),
  );
}

/** @param {number} value */
const short = (value) => (value < 9.95 ? value.toFixed(1) : String(Math.round(value)));

const BACKGROUNDS = { grey: "Grey", black: "Black", white: "White", checks: "Checks" };
const BACKGROUND = "penumbra:background";

/** A choice of what lies behind the picture, kept for the next one. @param {HTMLElement} stage */
export function makeBackground(stage) {
  /** @type {HTMLSelectElement} */
  const select = makeSelect(
    { id: "background", onchange: () => (keep("localStorage", BACKGROUND, select.value), show()) },
    Object.entries(BACKGROUNDS),
    kept("localStorage", BACKGROUND),
  );
  const show = () => (stage.dataset.background = select.value);
  show();
  return field("Background", select);
}

/** A button that fills the display, where the browser can. @param {HTMLElement} viewer */
export function makeFullscreen(viewer) {
  const toggle = () =>
    document.fullscreenElement ? document.exitFullscreen() : viewer.requestFullscreen().catch(() => {});
  return makeIconButton("fullscreen", {
    title: "Full screen",
    hidden: !document.fullscreenEnabled,
    onclick: toggle,
  });
}

// Milliseconds for which a button shows that it has copied.
const DONE_MS = 2000;

/** A button that copies the address of what is shown. @param {() => void} write - Brings the address up to date. */
export function makeLink(write) {
  const button = makeIconButton("link", { title: "Copy link", onclick: copy });

  async function copy() {
    write();
    const isCopied = await copied(location.href);
    announce(isCopied ? "The link is copied." : "Nothing was copied.");
    if (!isCopied) return;
    button.replaceChildren(makeIcon("done"));
    setTimeout(() => button.replaceChildren(makeIcon("link")), DONE_MS);
  }

  return button;
}

/** @type {[Channel, string][]} */
const CHANNELS = [
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
  const select = makeSelect({ id: "shown-channel", onchange: () => (show(), changed()) }, CHANNELS, begun);
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
  return h("button", { title, onclick: choose }, "Auto exposure");
}
