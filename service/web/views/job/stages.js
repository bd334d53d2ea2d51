// The stages of a plan by their share of the time: one bar, the five largest, and the others folded.

import { h } from "../../dom.js";
import { makeList } from "../../elements.js";
import { percent, plural } from "../../format.js";

const SHOWN = 5;
// A light by its number, in the name or the sentence of a stage.
const LIGHT = /\blight \d+/;

/** @import { Child } from "../../dom.js" @import { Lines } from "./plan.js" */
/** @typedef {(place: number) => Node | null} Sign Marks a stage by its place in the list. */

/** @param {PlanStage[]} stages @param {Lines} lines @returns {Child[]} */
export function makeStages(stages, lines) {
  const ranked = grouped(stages).sort((one, other) => (other.share ?? 0) - (one.share ?? 0));
  const parts = ranked
    .flatMap((stage) => (stage.share ? { ...stage, share: stage.share } : []))
    .slice(0, SHOWN);
  if (!parts.length) return [listed(ranked, lines)];
  const others = ranked.slice(parts.length);
  const rest = others.reduce((sum, { share }) => sum + (share ?? 0), 0);
  return [
    bar(parts, rest),
    listed(parts, lines, (i) => h("span", { className: `part part-${i}`, "aria-hidden": "true" })),
    others.length > 0 &&
      folded(`${plural(others.length, "more stage")}, ${small(rest)} of the time`, others, lines),
  ];
}

/** A list of stages behind a line that opens it. @param {string} title @param {PlanStage[]} stages @param {Lines} lines */
export function folded(title, stages, lines) {
  return h("details", h("summary", title), listed(stages, lines));
}

/** Stages that differ in the number of their light become one. @param {PlanStage[]} stages */
function grouped(stages) {
  /** @type {Map<string, PlanStage[]>} */
  const groups = new Map();
  for (const stage of stages) {
    const key = [stage.name, stage.detail].join("\n").replaceAll(new RegExp(LIGHT, "g"), "light");
    groups.set(key, [...(groups.get(key) ?? []), stage]);
  }
  return [...groups.values()].map((members) => (members.length > 1 ? together(members) : members[0]));
}

/** @param {PlanStage[]} members @returns {PlanStage} */
function together(members) {
  const [{ name, detail }] = members;
  const lights = `${members.length} lights`;
  const shares = members.flatMap(({ share }) => share ?? []);
  return {
    name: name.replace(LIGHT, lights),
    detail: detail.replace(LIGHT, LIGHT.test(name) ? "each" : lights),
    share: shares.length < members.length ? null : shares.reduce((sum, share) => sum + share, 0),
    pointers: [...new Set(members.flatMap(({ pointers }) => pointers))],
  };
}

/** @param {{name: string, share: number}[]} parts @param {number} rest */
function bar(parts, rest) {
  const whole = parts.reduce((sum, { share }) => sum + share, rest);
  const piece = (/** @type {number} */ share, /** @type {string} */ name) => {
    const one = h("span", { className: `part ${name}` });
    one.style.flexGrow = String(share / whole);
    return one;
  };
  const words = parts.map(({ name, share }) => `${name} ${small(share)}`).join(", ");
  return h(
    "div.stages-bar",
    { role: "img", "aria-label": `Shares of the time: ${words}` },
    parts.map(({ share }, i) => piece(share, `part-${i}`)),
    rest > 0 && piece(rest, "part-rest"),
  );
}

/** @param {PlanStage[]} stages @param {Lines} lines @param {Sign} sign */
const listed = (stages, lines, sign = () => null) =>
  makeList("ol.stages", stages, (stage, i) => entry(stage, lines, sign(i)));

/** @param {PlanStage} stage @param {Lines} lines @param {Node | null} sign */
function entry({ name, detail, share, pointers }, lines, sign) {
  const known = share !== null && share !== undefined;
  return [
    h(
      "div.stage-name",
      h("strong", name),
      known && h("span.soft.small", small(share), h("span.unseen", " of the time")),
      sign,
    ),
    h("p.soft.small", detail),
    pointers.length > 0 && lines(pointers),
  ];
}

/** @param {number} share */
const small = (share) => (share > 0 && share < 0.005 ? "under 1 %" : percent(share));
