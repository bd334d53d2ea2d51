// The body of a request, around a scene's own text: its lines stay where the person who wrote it sees them.

import { places, readable } from "./json_text.js";

const HEAD = '{"scene":';

/** @param {string} scene - JSON. @param {object} rest - The other fields; null and undefined ones are left out. */
export function requestText(scene, rest = {}) {
  const fields = Object.entries(rest).filter(([, value]) => value !== null && value !== undefined);
  const tail = fields.map(([name, value]) => `,${JSON.stringify(name)}:${JSON.stringify(value)}`).join("");
  return `${HEAD}${scene}${tail}}`;
}

/**
 * A problem of such a body as one of the scene's text: its pointer begins at the scene, and so does its column. One of
 * another field has no line, and keeps its pointer without the slash: `quality/error`.
 */
export function problemInScene(problem) {
  const isOfScene =
    problem.pointer === "" || problem.pointer === "/scene" || problem.pointer.startsWith("/scene/");
  if (!isOfScene) return { ...problem, pointer: problem.pointer.slice(1), line: undefined, column: undefined };
  const column = problem.line === 1 ? Math.max(1, problem.column - HEAD.length) : problem.column;
  return { ...problem, pointer: inScene(problem.pointer), column };
}

/** A pointer into such a body as one into its scene. @param {string} pointer */
export const inScene = (pointer) => pointer.replace(/^\/scene(?=\/|$)/, "");

/**
 * What a job was asked for, taken apart.
 *
 * @param {string} body - The request of the job, as it was sent.
 * @returns {{scene: string, quality: object | null, layers: string[]}} The scene as its own text.
 */
export function takenApart(body) {
  const place = places(body, ["/scene"]).get("/scene");
  const { quality = null, layers = [] } = JSON.parse(body);
  return { scene: readable(body.slice(place.value, place.end).trim()), quality, layers };
}
