// The states of a job in words and signs: no meaning by colour alone.

import { h } from "../../dom.js";

const STATES = {
  queued: ["◌", "queued"],
  running: ["▶", "running"],
  succeeded: ["✓", "finished"],
  failed: ["✕", "failed"],
  cancelled: ["■", "cancelled"],
  expired: ["–", "expired"],
};

export const NAMES = Object.keys(STATES);

export const stateName = (state) => STATES[state]?.[1] ?? state;

export function stateMark(state) {
  const [sign, name] = STATES[state] ?? ["?", state];
  return h("span", { className: `state ${state}` }, h("span", { "aria-hidden": "true" }, sign), ` ${name}`);
}
