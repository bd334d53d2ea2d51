// What is written on the start page, kept in the browser until its tab is closed, so that a reload loses nothing.

const KEY = "penumbra-draft";

/**
 * @typedef {object} Draft
 * @property {string} title
 * @property {string} text - The scene.
 * @property {string} entry - Of the gallery, or empty.
 * @property {string | null} job - Whose scene it was.
 * @property {object | null} quality
 * @property {string} labels - As written.
 * @property {boolean} layers
 */

/** @param {Draft} draft */
export function keepDraft(draft) {
  // Where storage is full or forbidden, a reload loses the draft.
  try {
    sessionStorage.setItem(KEY, JSON.stringify(draft));
  } catch {
    sessionStorage.clear();
  }
}

/** The draft that a page with this job, or with none, was left with. @returns {Draft | null} */
export function draftOf(job) {
  const draft = JSON.parse(sessionStorage.getItem(KEY) ?? "null");
  return draft?.job === job ? draft : null;
}
