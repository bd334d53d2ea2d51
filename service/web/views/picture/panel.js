// The picture of a job: it fills in while it renders, zooms, and explains single pixels.

import { get, jobPath } from "../../api.js";
import { announce, h } from "../../dom.js";
import { makeComparing } from "./comparing.js";
import { displayOf, makeDisplay, makeLayerChoice, makeZoom } from "./controls.js";
import { Developer } from "./develop.js";
import { Film } from "./film.js";
import { makeFirst } from "./first.js";
import { makeInspector } from "./inspector.js";
import { KEYS } from "./keys.js";
import { fetchLayer } from "./layer_files.js";
import { makeLegend } from "./legend.js";
import { Screen, square } from "./screen.js";

const AT_WORK = "#ffb43c";
// Frames are drawn inside their tiles, so that those of neighbours do not overlap.
const WITHIN = -1.5;
const CHOSEN = "#ffb43c";

export function mount(root, watch) {
  const { width, height, name, links } = watch.job;
  const film = new Film(width, height);
  const label = `Picture of ${name ?? "the job"}, ${width} by ${height} pixels`;
  const screen = new Screen({ width, height, label, overlay });
  const developer = new Developer(screen, film);
  const display = makeDisplay(() => developer.expose(display.exposure, display.transfer));
  const inspector = makeInspector(watch.id, (x, y) => film.at(x, y), watch.signal);
  const readout = h("p", { className: "readout number" });
  const keys = h("p", { className: "soft small", id: "picture-keys" }, KEYS);
  const legend = h("div");
  const refusal = h("p", { className: "problem", role: "alert", hidden: true });
  const first = makeFirst(watch, screen, () => inspector.pixel);
  let wanted = null;

  screen.element.setAttribute("aria-describedby", keys.id);
  const layers = Object.keys(links.layers ?? {});
  const tools = h(
    "div",
    { className: "row tools" },
    layers.length ? makeLayerChoice(layers, chooseLayer) : null,
    display.element,
    makeZoom(screen),
    first.element,
  );
  const viewer = h(
    "div",
    {},
    tools,
    refusal,
    screen.element,
    readout,
    legend,
    keys,
    inspector.element,
    makeComparing(watch),
  );
  const nothing = h("p", { className: "soft" });
  root.append(h("h2", { className: "unseen" }, "Picture"), viewer, nothing);

  function overlay(context) {
    developer.drawNumbers(context);
    for (const tile of watch.job.rendering)
      if (!isWhole(tile)) screen.outline(context, tile, AT_WORK, WITHIN);
    if (first.region) screen.outline(context, first.region);
    if (inspector.pixel) screen.outline(context, square(inspector.pixel), CHOSEN);
  }

  // A frame around the whole picture has no meaning.
  const isWhole = ({ x0, y0, x1, y1 }) => x1 - x0 >= width && y1 - y0 >= height;

  function read() {
    const pixel = screen.cursor;
    readout.textContent = pixel ? `${pixel.x}, ${pixel.y}   ${developer.describe(pixel.x, pixel.y)}` : "";
  }

  screen.addEventListener("cursor", ({ detail: pixel }) => {
    read();
    if (pixel && document.activeElement === screen.element) announce(readout.textContent);
  });
  screen.addEventListener("choose", async ({ detail: pixel }) => {
    const shown = inspector.show(pixel);
    first.show();
    await shown;
    screen.redraw();
  });
  screen.addEventListener("view", first.show);

  watch.on("tiles", (batch) => {
    if (!batch.tiles.length) return;
    developer.take(batch.tiles);
    read();
  });
  watch.on("job", () => (screen.redraw(), ended()));
  ended();

  function ended() {
    if (!watch.final) return;
    first.show();
    const empty = watch.job.state !== "succeeded" && film.empty;
    viewer.hidden = empty;
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
    legend.replaceChildren(layer ? makeLegend(layer, () => developer.show(layer)) : "");
    display.element.hidden = layer !== null;
    read();
  }

  get(`${jobPath(watch.id)}/request`, { signal: watch.signal }).then(
    ({ scene }) => display.begin(displayOf(scene)),
    () => display.begin(displayOf({})),
  );
  return () => (screen.close(), developer.close());
}
