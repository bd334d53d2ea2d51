// The histogram of a picture, with what is white at the present exposure.

import { debounced, h } from "../../dom.js";
import { percent } from "../../format.js";
import { STOPS, countClipped, histogramOf, histogramOfLayer } from "./histogram.js";
import { short } from "./numbers.js";

const WIDTH = 320;
const HEIGHT = 96;
const COLORS = ["#f33", "#2c2", "#46f"];
// Milliseconds without new tiles or another exposure before values are counted again.
const CALM_MS = 300;

/**
 * @param {import("./develop.js").Developer} developer
 * @param {AbortSignal} signal
 * @returns {{element: HTMLElement, changed: () => void, expose: (exposure: number) => void}} `changed` is to be called when
 *   something else is shown.
 */
export function makeHistogram(developer, signal) {
  const canvas = h("canvas.histogram", { width: WIDTH, height: HEIGHT, role: "img" });
  const caption = h("figcaption.soft.small");
  /** @type {import("./histogram.js").Histogram | null} */
  let histogram = null;
  let exposure = 0;
  // In a closed drawer nothing is counted.
  let isVisible = false;
  const soon = debounced(CALM_MS, () => isVisible && show(), signal);

  function show() {
    const { layer } = developer;
    const film = developer.filmAt(0);
    histogram ??= layer ? histogramOfLayer(layer) : histogramOf(film);
    draw(canvas, histogram.counts, layer ? null : exposure);
    caption.textContent = layer
      ? layerWords(layer, histogram)
      : words(histogram, countClipped(film, exposure));
    canvas.setAttribute("aria-label", `Histogram. ${caption.textContent}`);
  }

  const observer = new IntersectionObserver((entries) => {
    isVisible = entries[entries.length - 1].isIntersecting;
    if (isVisible) show();
  });
  const element = h("figure.histogram-figure", canvas, caption);
  observer.observe(element);
  signal.addEventListener("abort", () => observer.disconnect());

  return {
    element,
    changed() {
      histogram = null;
      // Numbers of shapes are names.
      element.hidden = developer.layer?.kind === "names";
      soon();
    },
    expose(stops) {
      exposure = stops;
      if (!isVisible || !histogram || developer.layer) return;
      draw(canvas, histogram.counts, exposure);
      soon();
    },
  };
}

/** @param {number} stops */
const across = (stops) => ((stops - STOPS.low) / (STOPS.high - STOPS.low)) * WIDTH;

/** @param {HTMLCanvasElement} canvas @param {Uint32Array[]} counts @param {number | null} exposure - Null without a white. */
function draw(canvas, counts, exposure) {
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const most = Math.log1p(Math.max(1, ...counts.map((bins) => Math.max(...bins))));
  context.globalCompositeOperation = "source-over";
  context.fillStyle = "#181818";
  context.fillRect(0, 0, WIDTH, HEIGHT);
  context.fillStyle = "#3a3a3a";
  if (exposure !== null)
    for (let stop = STOPS.low + 2; stop < STOPS.high; stop += 2) context.fillRect(across(stop), 0, 1, HEIGHT);
  context.globalCompositeOperation = "lighter";
  counts.forEach((bins, channel) => {
    context.fillStyle = counts.length > 1 ? COLORS[channel] : "#ccc";
    const width = WIDTH / bins.length;
    bins.forEach((count, bin) => {
      const height = (HEIGHT * Math.log1p(count)) / most;
      context.fillRect(bin * width, HEIGHT - height, width, height);
    });
  });
  context.globalCompositeOperation = "source-over";
  context.fillStyle = "#fff";
  if (exposure !== null) context.fillRect(across(-exposure) - 1, 0, 2, HEIGHT);
}

/** @param {import("./layers.js").Layer} layer @param {import("./histogram.js").Histogram} histogram */
function layerWords({ name, range: { low, high, log } }, { infinite }) {
  return (
    `${name} from ${short(low)} to ${short(high)}${log ? " by equal ratios" : ""}; counts are logarithmic.` +
    (infinite ? ` ${infinite} values are not finite.` : "")
  );
}

/** @param {import("./histogram.js").Histogram} histogram @param {number} clipped */
function words({ dark, infinite, total }, clipped) {
  const share = (/** @type {number} */ count) => percent(count / Math.max(1, total), 1);
  return (
    `Counts are logarithmic, lines are two stops apart, the white line is display white: ${share(clipped)} of the ` +
    `values lie above it, ${share(dark)} are zero or below.${infinite ? ` ${infinite} are not finite.` : ""}`
  );
}
