// Controls of the viewer: layer, exposure, transfer function, zoom, background, full screen.

import { announce, h } from "../../dom.js";
import { field } from "../../elements.js";
import { keep, kept } from "../../storage.js";
import { makeIcon } from "./icons.js";
import { copied } from "./readout.js";
import { TRANSFERS } from "./transfer.js";

/** @type {Record<string, string>} */
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
  const transfer = h(
    "select",
    { id: "display-transfer", onchange: changed },
    Object.keys(TRANSFERS).map((name) => h("option", { value: name }, WORDS[name])),
  );
  const scene = { exposure: 0, transfer: "srgb" };
  const reset = h(
    "button",
    { type: "button", className: "plain", title: "Use the settings of the scene", onclick: () => set(scene) },
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
    element: h(
      "div",
      { className: "display" },
      field("Exposure", exposure, stops),
      field("Transfer", transfer),
      reset,
    ),
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
  const select = h(
    "select",
    { id: "shown-layer", onchange: () => changed(select.value) },
    choices.map(([value, label]) => h("option", { value }, label)),
  );
  return { element: field("Shown", select), select };
}

/**
 * Buttons that zoom a screen, around the zoom itself: 100 % shows a pixel of the picture as one of the display.
 *
 * @param {PictureScreen} screen
 */
export function makeZoom(screen) {
  /** @param {string} name @param {string} label @param {() => void} action */
  const sign = (name, label, action) =>
    h("button", { type: "button", "aria-label": name, title: name, onclick: action }, label);
  /** @param {string} label @param {string} title @param {() => void} action */
  const button = (label, title, action) => h("button", { type: "button", title, onclick: action }, label);
  const zoom = h("output", { className: "number", title: "Zoom", "aria-label": "Zoom" });
  const show = () => (zoom.textContent = `${short(100 * screen.zoomed)} %`);
  screen.on("view", show);
  return h(
    "div",
    { className: "zoom", role: "group", "aria-label": "Zoom" },
    sign("Zoom out", "−", () => screen.zoom(screen.scale / 2)),
    zoom,
    sign("Zoom in", "+", () => screen.zoom(screen.scale * 2)),
    button("1:1", "A pixel of the picture as one of the display", () => screen.zoom(1 / devicePixelRatio)),
    button("Fit", "Show the whole picture", () => screen.fit()),
  );
}

/** @param {number} value */
const short = (value) => (value < 9.95 ? value.toFixed(1) : String(Math.round(value)));

/** @type {Record<string, string>} */
const BACKGROUNDS = { grey: "Grey", black: "Black", white: "White", checks: "Checks" };
const BACKGROUND = "penumbra:background";

/** A choice of what lies behind the picture, kept for the next one. @param {HTMLElement} stage */
export function makeBackground(stage) {
  const begun = kept("localStorage", BACKGROUND);
  /** @type {HTMLSelectElement} */
  const select = h(
    "select",
    { id: "background", onchange: () => (keep("localStorage", BACKGROUND, select.value), show()) },
    Object.entries(BACKGROUNDS).map(([value, name]) =>
      h("option", { value, selected: value === begun }, name),
    ),
  );
  const show = () => (stage.dataset.background = select.value);
  show();
  return field("Background", select);
}

/** A button that fills the display, where the browser can. @param {HTMLElement} viewer */
export function makeFullscreen(viewer) {
  const toggle = () =>
    document.fullscreenElement ? document.exitFullscreen() : viewer.requestFullscreen().catch(() => {});
  return h(
    "button",
    {
      type: "button",
      className: "icon",
      title: "Full screen",
      "aria-label": "Full screen",
      hidden: !document.fullscreenEnabled,
      onclick: toggle,
    },
    makeIcon("fullscreen"),
  );
}

// Milliseconds for which a button shows that it has copied.
const DONE_MS = 2000;

/** A button that copies the address of what is shown. @param {() => void} write - Brings the address up to date. */
export function makeLink(write) {
  const button = h(
    "button",
    { type: "button", className: "icon", title: "Copy link", "aria-label": "Copy link", onclick: copy },
    makeIcon("link"),
  );

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
