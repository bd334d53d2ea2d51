// The states of a job in words and signs: no meaning by colour alone.

import { h } from "../../dom.js";

const STATES = {
  queued: ["◌", "queued"],
  running: ["▶", "running"],
  paused: ["‖", "paused"],
  succeeded: ["✓", "finished"],
  failed: ["✕", "failed"],
  cancelled: ["■", "cancelled"],
  expired: ["–", "expired"],
};

/** The states by which jobs are found: one that is paused is queued or running meanwhile. */
export const NAMES = Object.keys(STATES).filter((name) => name !== "paused");

/** What a job is to people: a pause says more than the state in which it is held. */
export const standing = (job) => (job.paused ? "paused" : job.state);

export const stateName = (state) => STATES[state]?.[1] ?? state;

export function stateMark(state) {
  const [sign, name] = STATES[state] ?? ["?", state];
  return h("span", { className: `state ${state}` }, h("span", { "aria-hidden": "true" }, sign), ` ${name}`);
}
