// Renders a part of a running picture first.

import { jobPath, messageOf, post } from "../../api.js";
import { announce, h } from "../../dom.js";

// Size of the part around a pixel, as a share of the picture's sides, while all of it is shown.
const SHARE = 1 / 4;

/**
 * A button that is shown while the job runs. The part is what is visible if the picture is zoomed, or else the surroundings
 * of the chosen pixel.
 *
 * @param {import("../../watch.js").Watch} watch
 * @param {PictureScreen} screen
 * @param {() => PixelPlace | null} chosen
 */
export function makeFirst(watch, screen, chosen) {
  const button = h("button.stage-first", { onclick: ask }, "This part first");
  const self = { element: button, region: /** @type {PixelRectangle | null} */ (null), show };

  const isZoomed = () => screen.scale > screen.fitting;

  function wanted() {
    if (isZoomed()) return screen.visible();
    const pixel = chosen();
    return pixel && around(pixel, screen.width, screen.height);
  }

  async function ask() {
    const region = wanted();
    try {
      await post(`${jobPath(watch.id)}/focus`, region, { signal: watch.signal });
      self.region = region;
      screen.redraw();
      announce("This part is now rendered first.");
    } catch (error) {
      if (!watch.signal.aborted) announce(messageOf(error));
    }
  }

  function show() {
    button.hidden = watch.final;
    const region = wanted();
    button.disabled = !region;
    button.title = region
      ? `Render ${isZoomed() ? "the visible part" : "the part around the chosen pixel"} before the rest of each pass`
      : "Render a part of the picture before the rest of each pass: zoom in on the part, or click a pixel of it";
    if (watch.final) self.region = null;
  }

  show();
  return self;
}

/** @param {PixelPlace} pixel @param {number} width @param {number} height */
function around({ x, y }, width, height) {
  const [across, along] = [width, height].map((side) => Math.ceil((side * SHARE) / 2));
  return {
    x0: Math.max(0, x - across),
    y0: Math.max(0, y - along),
    x1: Math.min(width, x + across),
    y1: Math.min(height, y + along),
  };
}
