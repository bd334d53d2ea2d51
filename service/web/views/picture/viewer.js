// The viewer of a picture: display controls, readout, legend, and why a pixel has its colour.

import { announce, debounced, h } from "../../dom.js";
import {
  makeAutoExposure,
  makeBackground,
  makeChannels,
  makeChoice,
  makeDisplay,
  makeFullscreen,
  makeLink,
  makeZoom,
} from "./controls.js";
import { Developer } from "./develop.js";
import { makeHistogram } from "./histogram_view.js";
import { makeInspector } from "./inspector.js";
import { KEYS } from "./keys.js";
import { makeLegend } from "./legend.js";
import { drawGrid } from "./overlay.js";
import { keepAddress, lookAt, pixelOf } from "./place.js";
import { makePopover } from "./popover.js";
import { makeReadout } from "./readout.js";
import { Screen, square } from "./screen.js";
import { makeStatistics } from "./statistics_view.js";
import { makeZebra } from "./zebra.js";

// Without changes for so long, the statistics are taken again.
const CALM_MS = 300;
const CHOSEN = "#ffb43c";
// In narrower windows the display controls are in the popover of the toolbar.
const NARROW = matchMedia("(max-width: 60rem)");

/** @typedef {ReturnType<typeof makeViewer>} Viewer */

/**
 * @param {import("./frame.js").Frame} frame - With a tab "pixel".
 * @param {import("./film.js").Film} film
 * @param {object} options
 * @param {string} options.label - What the picture is.
 * @param {string} [options.keys] - Further keys.
 * @param {[string, string][]} options.choices - What can be shown: names and labels.
 * @param {(name: string) => void} options.choose - Show one of them.
 * @param {(context: CanvasRenderingContext2D) => void} options.overlay - Draws over the picture.
 * @param {() => Record<string, string | null>} [options.inAddress] - What the address says besides.
 * @param {AbortSignal} options.signal
 */
export function makeViewer({ viewer, controls, stage, drawer }, film, options) {
  const { label, choices, signal } = options;
  const { width, height } = film;
  const screen = new Screen({ width, height, label: `${label}, ${width} by ${height} pixels`, overlay });
  const developer = new Developer(screen, film);
  const display = makeDisplay(() => {
    developer.expose(display.exposure, display.transfer);
    histogram.expose(display.exposure);
    readout.show();
    address.changed();
  });
  const address = keepAddress(screen, inAddress, signal);
  const histogram = makeHistogram(developer, signal);
  const statistics = makeStatistics(screen, () => developer.shown);
  const recount = debounced(CALM_MS, statistics.changed, signal);
  const readout = makeReadout(screen, developer);
  const why = h("div.why");
  const keys = h("p.soft.small", { id: "picture-keys" }, `${KEYS} ${options.keys ?? ""}`);
  const legend = h("div.stage-legend");
  const choice = makeChoice(choices, choose);
  const zebra = makeZebra(developer);
  // Layers have no exposure and no white.
  const tools = h(
    "div.display",
    makeAutoExposure(film, (exposure) => display.set({ exposure })),
    makeChannels(developer, address.asked.get("channel"), address.changed),
    zebra.element,
  );
  const settings = makePopover("Display", "display-settings", tools, makeBackground(stage));
  /** @type {import("./inspector.js").Inspector[]} */
  const inspectors = [];

  screen.element.setAttribute("aria-describedby", keys.id);
  controls.append(
    makeZoom(screen),
    settings.button,
    makeLink(address.write),
    makeFullscreen(viewer),
    settings.panel,
  );
  stage.append(screen.element, readout.element, legend);
  drawer.panels.pixel.append(why, histogram.element, statistics.element, keys);
  NARROW.addEventListener("change", settle, { signal });
  settle();

  function settle() {
    const shown = choices.length > 1 ? [choice.element, display.element] : [display.element];
    if (NARROW.matches) settings.panel.prepend(...shown);
    else controls.prepend(...shown);
  }

  /** @param {string} name */
  function choose(name) {
    options.choose(name);
    address.changed();
  }

  /** What the address says beside the visible part. */
  function inAddress() {
    const layer = choice.select.value;
    const { channel } = developer.look;
    return {
      ...options.inAddress?.(),
      ...display.asked,
      layer: layer === choices[0][0] ? null : layer,
      channel: channel === "rgb" ? null : channel,
      tab: drawer.shown === drawer.first ? null : drawer.shown,
      pixel: self.pixel && `${self.pixel.x},${self.pixel.y}`,
    };
  }

  /** @param {CanvasRenderingContext2D} context */
  function overlay(context) {
    zebra.draw(context);
    drawGrid(context, screen);
    developer.drawNumbers(context);
    options.overlay(context);
    statistics.draw(context);
    const { pixel } = self;
    if (!pixel) return;
    if (drawer.shown === "pixel") inspectorAt(pixel)?.draw(context, screen);
    screen.outline(context, square(pixel), CHOSEN);
  }

  /** The inspector of the film that is shown at a pixel. @param {PixelPlace} pixel */
  function inspectorAt({ x }) {
    return inspectors[developer.films.indexOf(developer.filmAt(x))];
  }

  screen.on("cursor", (pixel) => {
    readout.show();
    if (pixel && document.activeElement === screen.element) announce(readout.text);
  });
  screen.on("choose", async (pixel) => {
    drawer.show("pixel");
    self.pixel = pixel;
    address.changed();
    // What was clicked comes first.
    why.prepend(inspectorAt(pixel)?.element ?? "");
    await Promise.all(inspectors.map((inspector) => inspector.show(pixel)));
    screen.redraw();
  });
  screen.on("copy", readout.copy);
  screen.on("clear", () => (forget(), statistics.clear()));

  /** Remove the chosen pixel and its lines. */
  function forget() {
    self.pixel = null;
    for (const inspector of inspectors) inspector.clear();
    address.changed();
    screen.redraw();
  }

  const self = {
    address,
    screen,
    developer,
    /** Show the picture with the settings of its scene. @param {DisplaySettings} settings */
    expose: (settings) => display.begin(settings, address.asked),
    readout,
    choice: choice.select,
    settings: settings.panel,
    /** The pixel that was chosen last. @type {PixelPlace | null} */
    pixel: null,
    /** Show what the address names. */
    begin() {
      const { asked } = address;
      const [layer, tab] = [asked.get("layer"), asked.get("tab") ?? ""];
      lookAt(screen, asked);
      if (choices.some(([name]) => name === layer)) choice.select.value = layer ?? "";
      if (!choice.select.disabled && choice.select.value !== choices[0][0]) choose(choice.select.value);
      const pixel = pixelOf(asked.get("pixel"), screen);
      if (pixel) {
        screen.reveal(pixel);
        screen.choose(pixel);
      }
      if (drawer.tabs.has(tab)) drawer.show(tab);
    },
    close: () => (screen.close(), developer.close()),
    /** Note that the film has changed. */
    changed() {
      zebra.changed();
      histogram.changed();
      recount();
      readout.show();
    },
    /** Show a layer, or the picture where it is null. @param {import("./layers.js").Layer | null} layer */
    show(layer) {
      developer.show(layer);
      statistics.changed();
      histogram.changed();
      const scaled = () => (developer.show(layer), histogram.changed());
      legend.replaceChildren(layer ? makeLegend(layer, scaled) : "");
      display.element.inert = tools.inert = layer !== null;
      readout.show();
    },
    /**
     * Explain the pixels of a job, whose films are compared in this order.
     *
     * @param {string} id
     * @param {SceneDocument} scene
     * @param {string} [name] - Of its picture, if there are several.
     */
    explain(id, scene, name = "") {
      const its = developer.films[inspectors.length];
      const inspector = makeInspector({
        id,
        scene,
        name,
        film: its,
        copy: readout.copy,
        close: () => (forget(), screen.element.focus({ preventScroll: true })),
        signal,
      });
      inspectors.push(inspector);
      why.append(inspector.element);
      if (self.pixel) inspector.show(self.pixel).then(() => screen.redraw());
    },
  };
  drawer.addEventListener("change", () => (address.changed(), screen.redraw()));
  return self;
}
