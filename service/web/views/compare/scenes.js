// Where two scenes differ.

import { h } from "../../dom.js";
import { makeTable } from "../../elements.js";
import { plural } from "../../format.js";

const MOST_ROWS = 100;
// Letters of a value; longer ones, such as whole shapes, are cut off.
const MOST_LETTERS = 80;

/** @typedef {{pointer: string, a: unknown, b: unknown}} Difference Undefined where a scene has no value. */

/**
 * The innermost objects and lists that differ; a list of numbers, such as a colour, is one value.
 *
 * @param {unknown} a
 * @param {unknown} b
 * @returns {Difference[]}
 */
export function differencesOf(a, b, pointer = "") {
  if (JSON.stringify(a) === JSON.stringify(b)) return [];
  if (!isNested(a) || !isNested(b) || Array.isArray(a) !== Array.isArray(b)) return [{ pointer, a, b }];
  return [...new Set([...Object.keys(a), ...Object.keys(b)])].flatMap((key) =>
    differencesOf(a[key], b[key], `${pointer}/${key.replaceAll("~", "~0").replaceAll("/", "~1")}`),
  );
}

/** @param {unknown} value @returns {value is Record<string, unknown>} */
const isNested = (value) =>
  typeof value === "object" &&
  value !== null &&
  !(Array.isArray(value) && value.every((one) => typeof one === "number"));

/** @param {SceneDocument} a @param {SceneDocument} b */
export function makeScenes(a, b) {
  const found = differencesOf(a, b);
  if (!found.length) return h("p", "Both scenes are the same.");
  const rest = found.length - MOST_ROWS;
  return h(
    "div",
    makeTable(".sides", ["Field", "A", "B"], found.slice(0, MOST_ROWS).map(row)),
    rest > 0 ? h("p.soft.small", `${plural(rest, "more difference")}.`) : "",
  );
}

/** @param {Difference} difference */
const row = ({ pointer, a, b }) => [h("code", pointer), brief(a), brief(b)];

/** @param {unknown} value */
function brief(value) {
  if (value === undefined) return "–";
  const text = JSON.stringify(value);
  return h("code", text.length > MOST_LETTERS ? `${text.slice(0, MOST_LETTERS)} …` : text);
}
