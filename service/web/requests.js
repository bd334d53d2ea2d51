// Request bodies around the text of a scene, so that its line numbers stay the same.

import { WIDTH, places, readable } from "./json_text.js";

const HEAD = '{"scene":';

/** @param {string} scene - JSON. @param {Record<string, unknown>} rest - The other fields; null and undefined ones are left out. */
export function requestText(scene, rest = {}) {
  const fields = Object.entries(rest).filter(([, value]) => value !== null && value !== undefined);
  const tail = fields.map(([name, value]) => `,${JSON.stringify(name)}:${JSON.stringify(value)}`).join("");
  return `${HEAD}${scene}${tail}}`;
}

/**
 * Convert a problem of a request body into one of the scene's text, with pointer and column relative to the scene. A
 * problem of another field has no line, and keeps its pointer without the slash: `quality/error`.
 *
 * @param {ProblemEntry} problem
 * @returns {ProblemEntry}
 */
export function problemInScene(problem) {
  const isOfScene =
    problem.pointer === "" || problem.pointer === "/scene" || problem.pointer.startsWith("/scene/");
  if (!isOfScene)
    return { ...problem, pointer: problem.pointer.slice(1), line: undefined, column: undefined };
  const { line, column } = problem;
  const own = line === 1 && column ? Math.max(1, column - HEAD.length) : column;
  return { ...problem, pointer: inScene(problem.pointer), column: own };
}

/** Convert a pointer into a request body to one into its scene. @param {string} pointer */
export const inScene = (pointer) => pointer.replace(/^\/scene(?=\/|$)/, "");

/**
 * Find text behind a scene, which would become fields of the request.
 *
 * @param {string} text
 * @returns {{line: number, column: number} | null}
 */
export function behindScene(text) {
  const body = requestText(text);
  const place = places(body, ["/scene"]).get("/scene");
  if (!place || !body.slice(place.end, -1).trim()) return null;
  const before = body.slice(HEAD.length, place.end).split("\n");
  return { line: before.length, column: (before.at(-1) ?? "").length + 1 };
}

/**
 * Split the request of a job into its parts.
 *
 * @param {string} body - The request of the job, which the service keeps without blanks.
 * @returns {{scene: string, quality: QualityDocument | null, layers: string[], labels: Record<string, string>, more:
 *   Record<string, unknown>}} The scene as a text for people; `more` has all other fields.
 */
export function takenApart(body) {
  const place = places(body, ["/scene"]).get("/scene");
  const { quality = null, layers = [], labels = {}, ...more } = JSON.parse(body);
  delete more.scene;
  const scene = place ? readable(body.slice(place.value, place.end), WIDTH) : "";
  return { scene, quality, layers, labels, more };
}
