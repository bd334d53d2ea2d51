// The picture of a job: it fills in while it renders, zooms, and explains single pixels.

import { get, jobPath } from "../../api.js";
import { announce, h } from "../../dom.js";
import { makeArrivals } from "./arrivals.js";
import { makeAutoExposure, makeChannels, makeZebra } from "./channels.js";
import { makeComparing } from "./comparing.js";
import { displayOf, makeDisplay, makeLayerChoice, makeZoom } from "./controls.js";
import { copied } from "./copying.js";
import { Developer } from "./develop.js";
import { Film } from "./film.js";
import { makeFirst } from "./first.js";
import { drawGrid } from "./grid.js";
import { makeHistogram } from "./histogram_view.js";
import { makeInspector } from "./inspector.js";
import { KEYS } from "./keys.js";
import { fetchLayer } from "./layer_files.js";
import { makeLegend } from "./legend.js";
import { makePath } from "./path.js";
import { keepPlace } from "./place.js";
import { makePopover } from "./popover.js";
import { makeReadout } from "./readout.js";
import { Screen, square } from "./screen.js";
import { makeStatistics } from "./statistics_view.js";
import { makeBackground, makeFullscreen } from "./surroundings.js";
import { drawTiles } from "./tiles.js";

const CHOSEN = "#ffb43c";
// In narrower windows the display controls are in the popover of the toolbar.
const NARROW = matchMedia("(max-width: 60rem)");

export function mount({ viewer, bar, stage, drawer }, watch) {
  const { width, height, links } = watch.job;
  const film = new Film(width, height);
  const label = `Picture of ${watch.job.name ?? "the job"}, ${width} by ${height} pixels`;
  const screen = new Screen({ width, height, label, overlay });
  const developer = new Developer(screen, film);
  const display = makeDisplay(() => {
    developer.expose(display.exposure, display.transfer);
    histogram.expose(display.exposure);
  });
  const histogram = makeHistogram(film);
  const statistics = makeStatistics(screen, () => developer.shown);
  const inspector = makeInspector(watch.id, (x, y) => film.at(x, y), copy, watch.signal);
  const readout = makeReadout(screen, developer);
  const keys = h("p", { className: "soft small", id: "picture-keys" }, KEYS);
  const legend = h("div", { className: "stage-legend" });
  const refusal = h("p", { className: "problem stage-notice", role: "alert", hidden: true });
  const nothing = h("p", { className: "stage-nothing", hidden: true });
  const first = makeFirst(watch, screen, () => inspector.pixel);
  const layers = Object.keys(links.layers ?? {});
  // What else looks at the picture: elements by the place where they stand.
  const tools = {
    bar: [makeZoom(screen)],
    display: [
      makeAutoExposure(film, (exposure) => display.set({ exposure })).element,
      makeChannels(developer).element,
      makeZebra(developer).element,
      makeBackground(stage),
    ],
    render: [],
    pixel: [inspector.element, histogram.element, statistics.element, keys],
    compare: [makeComparing(watch, screen)],
  };
  const arrivals = makeArrivals(screen);
  let wanted = null;
  let drawPath = null;

  const settings = makePopover("Display", "display-settings", ...tools.display);
  screen.element.setAttribute("aria-describedby", keys.id);
  const choices = [layers.length ? makeLayerChoice(layers, chooseLayer) : null, display.element].filter(
    Boolean,
  );
  bar.controls.append(...tools.bar, settings.button, makeFullscreen(viewer), settings.panel);
  stage.append(screen.element, readout.element, legend, first.element, refusal, nothing);
  for (const place of ["render", "pixel", "compare"]) drawer.panels[place].append(...tools[place]);
  keepPlace(screen, watch.signal);
  NARROW.addEventListener("change", settle, { signal: watch.signal });
  settle();

  function settle() {
    if (NARROW.matches) settings.panel.prepend(...choices);
    else bar.controls.prepend(...choices);
  }

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

  const read = () => readout.show(screen.cursor);

  screen.addEventListener("cursor", ({ detail: pixel }) => {
    read();
    if (pixel && document.activeElement === screen.element) announce(readout.text);
  });
  screen.addEventListener("choose", async ({ detail: pixel }) => {
    drawer.show("pixel");
    const shown = inspector.show(pixel);
    first.show();
    await shown;
    screen.redraw();
  });
  screen.addEventListener("view", first.show);
  screen.addEventListener("copy", ({ detail: pixel }) => copy(pixel));

  async function copy({ x, y }) {
    const values = developer.layer?.at(x, y) ?? film.at(x, y);
    const done = values && (await copied(values.join(" ")));
    announce(done ? `The values of pixel ${x}, ${y} are copied.` : "Nothing was copied.");
  }

  watch.on("tiles", (batch) => {
    if (!batch.tiles.length) return;
    if (!developer.layer) arrivals.before(batch.tiles);
    developer.take(batch.tiles);
    histogram.changed();
    read();
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
    if (wanted && developer.layer?.stale !== false) chooseLayer(wanted);
  }

  async function chooseLayer(chosen) {
    wanted = chosen;
    refusal.hidden = true;
    try {
      const layer = chosen && (await fetchLayer(watch.id, chosen, watch.signal));
      if (wanted !== chosen) return;
      if (layer) layer.stale = !watch.final;
      show(layer);
    } catch (error) {
      if (watch.signal.aborted) return;
      refusal.textContent = error.message;
      refusal.hidden = false;
      show(null);
    }
  }

  function show(layer) {
    developer.show(layer);
    statistics.changed();
    legend.replaceChildren(layer ? makeLegend(layer, () => developer.show(layer)) : "");
    display.element.inert = layer !== null;
    read();
  }

  get(`${jobPath(watch.id)}/request`, { signal: watch.signal }).then(
    ({ scene }) => {
      drawPath = makePath(scene);
      display.begin(displayOf(scene));
    },
    () => display.begin(displayOf({})),
  );
  return () => (screen.close(), developer.close(), histogram.close());
}
