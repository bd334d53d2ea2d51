// What is written on the start page, kept in the browser until its tab is closed, so that a reload loses nothing.

import { debounced } from "../../dom.js";
import { keep, kept } from "../../storage.js";

const KEY = "penumbra-draft";
// A long scene takes milliseconds to keep: too many for every key.
const IDLE_MS = 300;

/**
 * @typedef {object} Draft
 * @property {string} title
 * @property {string} text - The scene.
 * @property {string} entry - Of the gallery, or empty.
 * @property {string | null} job - Whose scene it was.
 * @property {QualityDocument | null} quality
 * @property {string} labels - As written.
 * @property {boolean} layers
 */

/**
 * Keep what is written shortly after each change, and before the page is left.
 *
 * @param {() => Draft} written
 * @param {AbortSignal} signal
 * @returns {() => void} To be called after each change.
 */
export function makeKeeper(written, signal) {
  let changed = false;
  const later = debounced(IDLE_MS, store, signal);
  function store() {
    if (changed) keep("sessionStorage", KEY, JSON.stringify(written()));
    changed = false;
  }
  addEventListener("pagehide", store, { signal });
  document.addEventListener("visibilitychange", store, { signal });
  signal.addEventListener("abort", store);
  return () => {
    changed = true;
    later();
  };
}

/**
 * The draft that a page with this job, or with none, was left with.
 *
 * @param {string | null} job
 * @returns {Draft | null}
 */
export function draftOf(job) {
  const draft = JSON.parse(kept("sessionStorage", KEY) ?? "null");
  return draft?.job === job ? draft : null;
}
