// Drafts of the start page, one for each of its addresses, kept until the tab is closed: no reload loses anything.

import { StoredFile, digestOf } from "../../assets.js";
import { debounced } from "../../dom.js";
import { keep, keepLarge, kept, keptLarge } from "../../storage.js";

// A long scene takes milliseconds to keep: too many for every key.
const IDLE_MS = 300;

/**
 * @typedef {object} Draft
 * @property {string} title
 * @property {string} text - The scene.
 * @property {string} entry - Of the gallery, or empty.
 * @property {QualityDocument | null} quality
 * @property {string} labels - As written.
 * @property {boolean} layers
 * @property {[path: string, digest: string, size: number][]} files - Uploaded files.
 */

/** @param {string | null} job - Whose scene is changed, if any. */
const keyOf = (job) => `penumbra-draft ${job ?? ""}`;

/**
 * Keep a draft shortly after each change, and before the page is left; a draft that nothing keeps is not left unasked.
 *
 * @param {string | null} job
 * @param {() => Draft} written
 * @param {AbortSignal} signal
 * @returns {() => void} To be called after each change.
 */
export function makeKeeper(job, written, signal) {
  const key = keyOf(job);
  let changed = false;
  let unkept = false;
  const later = debounced(IDLE_MS, store, signal);

  async function store() {
    if (!changed) return;
    changed = false;
    const text = JSON.stringify(written());
    unkept = !keep("sessionStorage", key, text);
    if (!unkept) return;
    try {
      await keepLarge(key, text);
      unkept = changed;
    } catch {
      // Leaving asks.
    }
  }

  addEventListener("pagehide", store, { signal });
  document.addEventListener("visibilitychange", store, { signal });
  addEventListener("beforeunload", (event) => (store(), unkept && event.preventDefault()), { signal });
  signal.addEventListener("abort", store);
  return () => {
    changed = true;
    later();
  };
}

/** The draft of an address. @param {string | null} job @returns {Promise<Draft | null>} */
export async function draftOf(job) {
  const key = keyOf(job);
  return JSON.parse(kept("sessionStorage", key) ?? (await keptLarge(key)) ?? "null");
}

/** The uploaded ones of some files, for a draft. @param {Map<string, Blob | StoredFile>} files @returns {Draft["files"]} */
export const uploaded = (files) =>
  [...files].flatMap(([path, file]) => {
    const digest = digestOf(file);
    return digest ? [[path, digest, file.size]] : [];
  });

/** The files of a draft, which the service has. @param {Draft["files"]} files @returns {Map<string, StoredFile>} */
export const onService = (files) =>
  new Map(files.map(([path, digest, size]) => [path, new StoredFile(digest, size)]));
