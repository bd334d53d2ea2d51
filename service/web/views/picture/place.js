// The visible part of a picture in the address of its page, so that a link leads to it.

import { debounced } from "../../dom.js";
import { amend } from "../../navigation.js";

// Browsers refuse addresses that change too often.
const WAIT_MS = 250;

/**
 * Begin with the part that the address names, and keep the address in step.
 *
 * @param {PictureScreen} screen
 * @param {AbortSignal} signal
 */
export function keepPlace(screen, signal) {
  const query = new URLSearchParams(location.search);
  const [zoom, x, y] = ["zoom", "x", "y"].map((name) => Number(query.get(name) ?? NaN));
  if (zoom > 0 && Number.isFinite(x + y)) screen.look({ x, y, scale: zoom / 100 / devicePixelRatio });
  const write = debounced(WAIT_MS, () => amend(placeOf(screen)), signal);
  screen.on("view", write);
}

/** The place as parameters of an address; none while the whole picture is fitted. @param {PictureScreen} screen */
export function placeOf(screen) {
  if (screen.fitted) return { zoom: null, x: null, y: null };
  const { x, y } = screen.middle;
  return { zoom: round(100 * screen.zoomed), x: round(x), y: round(y) };
}

/** @param {number} value */
const round = (value) => String(Number(value.toFixed(2)));
