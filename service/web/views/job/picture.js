// The picture of a job: it fills in while it renders, shows its layers, and leads to comparisons.

import { get, jobPath, messageOf, request } from "../../api.js";
import { h } from "../../dom.js";
import { makeComparing } from "../picture/comparing.js";
import { displayOf } from "../picture/controls.js";
import { Film } from "../picture/film.js";
import { makeFirst } from "../picture/first.js";
import { Layer } from "../picture/layers.js";
import { decodeNpy } from "../picture/npy.js";
import { drawTiles, makeArrivals } from "../picture/overlay.js";
import { makeViewer } from "../picture/viewer.js";
import { nameOf } from "./state.js";

/** @import { Frame } from "../picture/frame.js" @import { Watch } from "../../watch.js" */

/** @param {Frame} frame @param {Watch} watch @param {AbortSignal} life */
export function mount(frame, watch, life) {
  const { stage, drawer } = frame;
  const { job, signal } = watch;
  const film = new Film(job.width, job.height);
  const viewer = makeViewer(frame, film, {
    label: `Picture of ${nameOf(job)}`,
    choices: [["", "Picture"], ...Object.keys(job.links.layers ?? {}).map(choiceOf)],
    choose: chooseLayer,
    overlay,
    signal,
  });
  const { screen, developer } = viewer;
  const refusal = h("p.problem.stage-notice", { role: "alert" });
  const nothing = h("p.stage-nothing", { hidden: true });
  const first = makeFirst(watch, screen, () => viewer.pixel);
  const arrivals = makeArrivals(screen);
  const comparing = makeComparing(job, viewer.address.write, signal);
  let wanted = "";
  // Whether the layer that is shown was fetched before the job had ended, or could not be.
  let isEarly = true;

  stage.append(first.element, refusal, nothing);
  drawer.panels.compare.append(comparing.element);

  /** @param {CanvasRenderingContext2D} context */
  function overlay(context) {
    arrivals.draw(context);
    drawTiles(context, screen, watch.job.rendering);
    if (first.region) screen.outline(context, first.region);
  }

  screen.on("choose", first.show);
  screen.on("view", first.show);

  watch.on("tiles", (batch) => {
    if (!batch.tiles.length) return;
    if (!developer.layer) arrivals.before(batch.tiles);
    developer.take(batch.tiles);
    viewer.changed();
  });
  watch.on("preview", (url) => (screen.canvas.style.backgroundImage = `url("${url}")`));
  watch.on("job", () => (screen.redraw(), ended()));
  viewer.begin();
  ended();

  // Other jobs come and go while this one is open.
  function offer() {
    if (watch.job.state === "succeeded" && drawer.shown === "compare") comparing.fill();
  }
  drawer.addEventListener("change", offer);

  function ended() {
    if (!watch.final) return;
    first.show();
    if (comparing.element.hidden) offer();
    const empty = watch.job.state !== "succeeded" && film.empty;
    screen.element.hidden = empty;
    nothing.hidden = !empty;
    nothing.textContent = empty ? `There is no picture: the job ended as ${watch.job.state}.` : "";
    screen.redraw();
    if (wanted && isEarly) chooseLayer(wanted);
  }

  /** @param {string} chosen - The name of a layer, or empty for the picture. */
  async function chooseLayer(chosen) {
    wanted = chosen;
    refusal.textContent = "";
    try {
      const { final } = watch;
      const layer = chosen ? await fetchLayer(watch.id, chosen, signal) : null;
      if (wanted !== chosen) return;
      isEarly = !final;
      viewer.show(layer);
    } catch (error) {
      if (signal.aborted || wanted !== chosen) return;
      isEarly = true;
      refusal.textContent = messageOf(error);
      viewer.show(null);
    }
  }

  get(`${jobPath(watch.id)}/request`, { signal }).then(
    (/** @type {JobRequestDocument} */ { scene }) => {
      viewer.explain(watch.id, scene);
      viewer.expose(displayOf(scene));
    },
    () => signal.aborted || viewer.expose(displayOf({})),
  );
  life.addEventListener("abort", viewer.close);
}

/** @param {string} layer @returns {[string, string]} */
const choiceOf = (layer) => [layer, layer.replace("_", " ")];

/** @param {string} id @param {string} name @param {AbortSignal} signal */
async function fetchLayer(id, name, signal) {
  const response = await request(`${jobPath(id)}/layers/${name}.npy`, { signal });
  const { shape, values } = decodeNpy(await response.arrayBuffer());
  return new Layer(name, shape, values);
}
