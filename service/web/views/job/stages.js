// The stages of a plan by their share of the time: one bar, the five largest, and the others folded.

import { h } from "../../dom.js";
import { percent, plural } from "../../format.js";

const SHOWN = 5;
// A light by its number, in the name or the sentence of a stage.
const LIGHT = /\blight \d+/;

/**
 * @param {object[]} stages - Of the plan.
 * @param {(pointers: string[]) => Node} lines - Makes links to the lines of the scene.
 * @returns {HTMLElement[]}
 */
export function makeStages(stages, lines) {
  const ranked = grouped(stages).sort((one, other) => (other.share ?? 0) - (one.share ?? 0));
  const parts = ranked.filter(({ share }) => share > 0).slice(0, SHOWN);
  if (!parts.length) return [listed(ranked, lines)];
  const others = ranked.slice(parts.length);
  const rest = others.reduce((sum, { share }) => sum + (share ?? 0), 0);
  return [
    bar(parts, rest),
    listed(parts, lines, (i) => h("span", { className: `part part-${i}`, "aria-hidden": "true" })),
    others.length
      ? folded(`${plural(others.length, "more stage")}, ${small(rest)} of the time`, others, lines)
      : "",
  ];
}

/** A list of stages behind a line that opens it. */
export function folded(title, stages, lines) {
  return h("details", {}, h("summary", {}, title), listed(stages, lines));
}

/** Stages that differ in the number of their light become one. */
function grouped(stages) {
  const groups = new Map();
  for (const stage of stages) {
    const key = [stage.name, stage.detail].join("\n").replaceAll(new RegExp(LIGHT, "g"), "light");
    groups.set(key, [...(groups.get(key) ?? []), stage]);
  }
  return [...groups.values()].map((members) => (members.length > 1 ? together(members) : members[0]));
}

function together(members) {
  const [{ name, detail }] = members;
  const lights = `${members.length} lights`;
  const shares = members.map(({ share }) => share ?? null);
  return {
    name: name.replace(LIGHT, lights),
    detail: detail.replace(LIGHT, LIGHT.test(name) ? "each" : lights),
    share: shares.includes(null) ? null : shares.reduce((sum, share) => sum + share, 0),
    pointers: [...new Set(members.flatMap(({ pointers }) => pointers))],
  };
}

function bar(parts, rest) {
  const whole = parts.reduce((sum, { share }) => sum + share, rest);
  const piece = (share, name) => {
    const one = h("span", { className: `part ${name}` });
    one.style.flexGrow = share / whole;
    return one;
  };
  const words = parts.map(({ name, share }) => `${name} ${small(share)}`).join(", ");
  return h(
    "div",
    { className: "stages-bar", role: "img", "aria-label": `Shares of the time: ${words}` },
    parts.map(({ share }, i) => piece(share, `part-${i}`)),
    rest > 0 ? piece(rest, "part-rest") : null,
  );
}

function listed(stages, lines, sign = () => null) {
  return h(
    "ol",
    { className: "stages" },
    stages.map((stage, i) => entry(stage, lines, sign(i))),
  );
}

function entry({ name, detail, share, pointers }, lines, sign) {
  const known = share !== null && share !== undefined;
  return h(
    "li",
    {},
    h(
      "div",
      { className: "stage-name" },
      h("strong", {}, name),
      known
        ? h(
            "span",
            { className: "soft small" },
            small(share),
            h("span", { className: "unseen" }, " of the time"),
          )
        : null,
      sign,
    ),
    h("p", { className: "soft small" }, detail),
    pointers.length ? lines(pointers) : null,
  );
}

const small = (share) => (share > 0 && share < 0.005 ? "under 1 %" : percent(share));
