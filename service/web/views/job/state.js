// The states of a job as words and signs, so that no meaning depends on colour alone.

import { h } from "../../dom.js";
import { percent } from "../../format.js";

/** @typedef {JobState | "paused"} Standing */

/** The sign and the word of each. @type {Record<string, [string, string]>} */
const STATES = {
  queued: ["◌", "queued"],
  running: ["▶", "running"],
  paused: ["‖", "paused"],
  succeeded: ["✓", "finished"],
  failed: ["✕", "failed"],
  cancelled: ["■", "cancelled"],
  expired: ["–", "expired"],
  deleted: ["✕", "deleted"],
};

/**
 * States to filter by: a paused job counts as queued or running, and a deleted one is in no list.
 *
 * @type {[string, string][]}
 */
export const CHOICES = Object.entries(STATES)
  .filter(([name]) => name !== "paused" && name !== "deleted")
  .map(([name, [, word]]) => [name, word]);

/**
 * The state to show: a paused job shows as paused, not as queued or running.
 *
 * @param {JobDocument} job
 * @returns {Standing}
 */
export const standing = (job) => (job.paused ? "paused" : job.state);

/** Whether a user may cancel, pause and delete a job: its owner and admins may. @param {{user: string, role: string} | null} who @param {JobDocument} job */
export const mayChange = (who, { user }) => who?.role === "admin" || who?.user === user;

/** @param {string} state */
export const stateName = (state) => STATES[state]?.[1] ?? state;

/** @param {Standing} state */
export function stateMark(state) {
  const [sign, name] = STATES[state] ?? ["?", state];
  return h("span", { className: `state ${state}` }, h("span", { "aria-hidden": "true" }, sign), ` ${name}`);
}

/** The title of a tab: what the job does, then its name. @param {JobDocument} job */
export function tabTitle(job) {
  const share = standing(job) === "running" ? `${percent(job.progress.share)} ` : "";
  return `${STATES[standing(job)]?.[0] ?? "?"} ${share}${nameOf(job)} · Penumbra`;
}

/** Whether the picture of an equal job was there when this one was submitted. @param {JobDocument} job */
export const existedAlready = (job) => job.state === "succeeded" && job.finished_at === job.started_at;

/** @param {JobDocument} job */
export const nameOf = (job) => job.name ?? "Untitled scene";
