// What a viewer shows in the address of its page, so that a link leads to it.

import { debounced } from "../../dom.js";
import { amend } from "../../navigation.js";

// Browsers refuse addresses that change too often.
const WAIT_MS = 250;

/**
 * Keep the address in step with a viewer.
 *
 * @param {PictureScreen} screen
 * @param {() => Record<string, string | null>} others - What is shown beside the visible part; null for what a page begins with.
 * @param {AbortSignal} signal
 */
export function keepAddress(screen, others, signal) {
  const asked = new URLSearchParams(location.search);
  const write = () => amend({ ...placeOf(screen), ...others() });
  const changed = debounced(WAIT_MS, write, signal);
  screen.on("view", changed);
  return { asked, write, changed };
}

/** Show the part of the picture that an address names. @param {PictureScreen} screen @param {URLSearchParams} asked */
export function lookAt(screen, asked) {
  const [zoom, x, y] = ["zoom", "x", "y"].map((name) => Number(asked.get(name) ?? NaN));
  if (zoom > 0 && Number.isFinite(x + y)) screen.look({ x, y, scale: zoom / 100 / devicePixelRatio });
}

/** The place as parameters of an address; none while the whole picture is fitted. @param {PictureScreen} screen */
function placeOf(screen) {
  if (screen.fitted) return { zoom: null, x: null, y: null };
  const { x, y } = screen.middle;
  return { zoom: round(100 * screen.zoomed), x: round(x), y: round(y) };
}

/** A number of an address. @param {number} value */
export const round = (value) => String(Number(value.toFixed(2)));

/** The pixel that an address names, or null. @param {string | null} text @param {PictureScreen} screen */
export function pixelOf(text, { width, height }) {
  const [, x, y] = (/^(\d+),(\d+)$/.exec(text ?? "") ?? []).map(Number);
  return x < width && y < height ? { x, y } : null;
}
