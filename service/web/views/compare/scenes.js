// Where two scenes differ.

import { h } from "../../dom.js";
import { makeTable } from "../../elements.js";
import { plural } from "../../format.js";
import { pointerPart } from "../../json_text.js";

const MOST_ROWS = 100;
// Letters of a value; longer ones, such as whole shapes, are cut off.
const MOST_LETTERS = 80;

/** @typedef {{place: string, a: unknown, b: unknown}} Difference Undefined where a scene has no value. */

/**
 * The innermost objects and lists that differ; a list of numbers, such as a colour, is one value.
 *
 * @param {unknown} a
 * @param {unknown} b
 * @returns {Difference[]}
 */
export function differencesOf(a, b, place = "") {
  if (JSON.stringify(a) === JSON.stringify(b)) return [];
  if (!isNested(a) || !isNested(b) || Array.isArray(a) !== Array.isArray(b)) return [{ place, a, b }];
  const [one, other] = [partsOf(a), partsOf(b)];
  const [keys, others] = [[...one.keys()], [...other.keys()]];
  const found = [...new Set([...keys, ...others])].flatMap((key) =>
    differencesOf(one.get(key), other.get(key), `${place}/${pointerPart(key)}`),
  );
  // Of shapes that overlap in one plane the first is seen.
  const isReordered = !found.length && Array.isArray(a) && keys.some((key, at) => key !== others[at]);
  return isReordered ? [{ place, a: keys, b: others }] : found;
}

/**
 * The members of an object, or the elements of an array by their names: an index is another element's once one is
 * inserted before it.
 *
 * @param {object} value
 */
function partsOf(value) {
  if (!Array.isArray(value)) return new Map(Object.entries(value));
  /** @type {Map<string, unknown>} */
  const parts = new Map();
  for (const [index, one] of value.entries()) {
    const name = one?.name;
    const isKey = typeof name === "string" && !/^\d+$/.test(name) && !parts.has(name);
    parts.set(isKey ? name : String(index), one);
  }
  return parts;
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
const row = ({ place, a, b }) => [h("code", place), brief(a), brief(b)];

/** @param {unknown} value */
function brief(value) {
  if (value === undefined) return "–";
  const text = JSON.stringify(value);
  return h("code", text.length > MOST_LETTERS ? `${text.slice(0, MOST_LETTERS)} …` : text);
}
