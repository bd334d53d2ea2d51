// The picture of a job: it fills in while it renders, zooms, and explains single pixels.

import { get, jobPath, messageOf, request } from "../../api.js";
import { announce, debounced, h } from "../../dom.js";
import { makeAutoExposure, makeChannels, makeZebra } from "./channels.js";
import { makeComparing } from "./comparing.js";
import {
  displayOf,
  makeBackground,
  makeDisplay,
  makeFullscreen,
  makeLayerChoice,
  makeZoom,
} from "./controls.js";
import { Developer } from "./develop.js";
import { Film } from "./film.js";
import { makeFirst } from "./first.js";
import { makeHistogram } from "./histogram_view.js";
import { makeInspector } from "./inspector.js";
import { KEYS } from "./keys.js";
import { Layer } from "./layers.js";
import { makeLegend } from "./legend.js";
import { decodeNpy } from "./npy.js";
import { drawGrid, drawTiles, makeArrivals } from "./overlay.js";
import { makePath } from "./path.js";
import { keepPlace } from "./place.js";
import { makePopover } from "./popover.js";
import { makeReadout } from "./readout.js";
import { Screen, square } from "./screen.js";
import { makeStatistics } from "./statistics_view.js";

// Without new tiles for so long, the statistics are taken again.
const CALM_MS = 300;
const CHOSEN = "#ffb43c";
// In narrower windows the display controls are in the popover of the toolbar.
const NARROW = matchMedia("(max-width: 60rem)");

/** @import { Places } from "../job.js" @import { Watch } from "../../watch.js" */

/** @param {Places} places @param {Watch} watch */
export function mount({ viewer, bar, stage, drawer }, watch) {
  const { width, height, links } = watch.job;
  const film = new Film(width, height);
  const label = `Picture of ${watch.job.name ?? "the job"}, ${width} by ${height} pixels`;
  const screen = new Screen({ width, height, label, overlay });
  const developer = new Developer(screen, film);
  const display = makeDisplay(() => {
    developer.expose(display.exposure, display.transfer);
    histogram.expose(display.exposure);
    readout.show();
  });
  const histogram = makeHistogram(film, watch.signal);
  const statistics = makeStatistics(screen, () => developer.shown);
  const readout = makeReadout(screen, developer);
  const inspector = makeInspector(watch.id, (x, y) => film.at(x, y), readout.copy, watch.signal);
  const keys = h("p", { className: "soft small", id: "picture-keys" }, KEYS);
  const legend = h("div", { className: "stage-legend" });
  const refusal = h("p", { className: "problem stage-notice", role: "alert", hidden: true });
  const nothing = h("p", { className: "stage-nothing", hidden: true });
  const first = makeFirst(watch, screen, () => inspector.pixel);
  const layers = Object.keys(links.layers ?? {});
  const arrivals = makeArrivals(screen);
  const recount = debounced(CALM_MS, statistics.changed, watch.signal);
  /** @type {string | null} */
  let wanted = null;
  // Whether the layer that is shown was fetched before the job had ended, or could not be.
  let isEarly = true;
  /** @type {ReturnType<typeof makePath> | null} */
  let drawPath = null;

  const settings = makePopover(
    "Display",
    "display-settings",
    makeAutoExposure(film, (exposure) => display.set({ exposure })),
    makeChannels(developer),
    makeZebra(developer),
    makeBackground(stage),
  );
  screen.element.setAttribute("aria-describedby", keys.id);
  const choices = [...(layers.length ? [makeLayerChoice(layers, chooseLayer)] : []), display.element];
  bar.controls.append(makeZoom(screen), settings.button, makeFullscreen(viewer), settings.panel);
  stage.append(screen.element, readout.element, legend, first.element, refusal, nothing);
  drawer.panels.pixel.append(inspector.element, histogram.element, statistics.element, keys);
  drawer.panels.compare.append(makeComparing(watch, screen));
  keepPlace(screen, watch.signal);
  NARROW.addEventListener("change", settle, { signal: watch.signal });
  settle();

  function settle() {
    if (NARROW.matches) settings.panel.prepend(...choices);
    else bar.controls.prepend(...choices);
  }

  /** @param {CanvasRenderingContext2D} context */
  function overlay(context) {
    arrivals.draw(context);
    drawGrid(context, screen);
    developer.drawNumbers(context);
    drawTiles(context, screen, watch.job.rendering);
    if (first.region) screen.outline(context, first.region);
    statistics.draw(context);
    if (inspector.found) drawPath?.(context, screen, inspector.found);
    if (inspector.pixel) screen.outline(context, square(inspector.pixel), CHOSEN);
  }

  screen.on("cursor", (pixel) => {
    readout.show();
    if (pixel && document.activeElement === screen.element) announce(readout.text);
  });
  screen.on("choose", async (pixel) => {
    drawer.show("pixel");
    const shown = inspector.show(pixel);
    first.show();
    await shown;
    screen.redraw();
  });
  screen.on("view", first.show);
  screen.on("copy", readout.copy);

  watch.on("tiles", (batch) => {
    if (!batch.tiles.length) return;
    if (!developer.layer) arrivals.before(batch.tiles);
    developer.take(batch.tiles);
    histogram.changed();
    recount();
    readout.show();
  });
  watch.on("job", () => (screen.redraw(), ended()));
  ended();

  function ended() {
    if (!watch.final) return;
    first.show();
    const empty = watch.job.state !== "succeeded" && film.empty;
    screen.element.hidden = empty;
    nothing.hidden = !empty;
    nothing.textContent = empty ? `There is no picture: the job ended as ${watch.job.state}.` : "";
    screen.redraw();
    if (wanted && isEarly) chooseLayer(wanted);
  }

  /** @param {string | null} chosen - The name of a layer, null for the picture. */
  async function chooseLayer(chosen) {
    wanted = chosen;
    refusal.hidden = true;
    try {
      const { final } = watch;
      const layer = chosen === null ? null : await fetchLayer(watch.id, chosen, watch.signal);
      if (wanted !== chosen) return;
      isEarly = !final;
      show(layer);
    } catch (error) {
      if (watch.signal.aborted || wanted !== chosen) return;
      isEarly = true;
      refusal.textContent = messageOf(error);
      refusal.hidden = false;
      show(null);
    }
  }

  /** @param {Layer | null} layer */
  function show(layer) {
    developer.show(layer);
    statistics.changed();
    legend.replaceChildren(layer ? makeLegend(layer, () => developer.show(layer)) : "");
    display.element.inert = layer !== null;
    readout.show();
  }

  get(`${jobPath(watch.id)}/request`, { signal: watch.signal }).then(
    (/** @type {JobRequestDocument} */ { scene }) => {
      drawPath = makePath(scene);
      display.begin(displayOf(scene));
    },
    () => watch.signal.aborted || display.begin(displayOf({})),
  );
  return () => (screen.close(), developer.close());
}

/** @param {string} id @param {string} name @param {AbortSignal} signal */
async function fetchLayer(id, name, signal) {
  const response = await request(`${jobPath(id)}/layers/${name}.npy`, { signal });
  const { shape, values } = decodeNpy(await response.arrayBuffer());
  return new Layer(name, shape, values);
}
