// Textures and meshes: which files a scene names, and how they reach the service.

import { Problem, request } from "./api.js";
import { pointerPart } from "./json_text.js";
import { sha256 } from "./sha256.js";

const UPLOADED = /^sha256:[0-9a-f]{64}$/;

/** @typedef {{asset?: unknown} | null} Naming */

/**
 * The files that a scene names.
 *
 * @param {{textures?: Record<string, Naming>, shapes?: Naming[]} | null} scene - Parsed JSON, not validated.
 * @returns {Map<string, string[]>} Pointers into the scene by the name of the file.
 */
export function assetNames(scene) {
  /** @type {Map<string, string[]>} */
  const names = new Map();
  const note = (/** @type {string} */ pointer, /** @type {unknown} */ asset) => {
    if (typeof asset === "string" && !UPLOADED.test(asset))
      names.set(asset, [...(names.get(asset) ?? []), pointer]);
  };
  for (const [name, texture] of Object.entries(scene?.textures ?? {})) {
    note(`/textures/${pointerPart(name)}/asset`, texture?.asset);
  }
  if (Array.isArray(scene?.shapes))
    scene.shapes.forEach((shape, i) => note(`/shapes/${i}/asset`, shape?.asset));
  return names;
}

/** @typedef {{file: Blob | null, several: string[]}} Found `several` has the paths among which to choose. */

/**
 * The file for each name: the one at this path, or else the one whose path has the longest end in common with it. A file
 * that fits two names equally well, or a name that two files fit, is not guessed.
 *
 * @param {Iterable<string>} names
 * @param {Map<string, Blob>} files - By path.
 * @returns {Map<string, Found>} By name.
 */
export function filesFor(names, files) {
  const wanted = [...names];
  const open = wanted.filter((name) => !files.has(name));
  const taken = new Set(wanted.map((name) => files.get(name)));
  const free = [...files.keys()].filter((path) => !taken.has(files.get(path)));
  return new Map(wanted.map((name) => [name, files.has(name) ? sure(name) : guessed(name)]));

  /** @param {string} path @returns {Found} */
  function sure(path) {
    return { file: files.get(path) ?? null, several: [] };
  }

  /** @param {string} name @returns {Found} */
  function guessed(name) {
    const near = best(free, (path) => common(name, path));
    const rivals = near.length === 1 ? best(open, (other) => common(other, near[0])) : [];
    if (rivals.length === 1 && rivals[0] === name) return sure(near[0]);
    // A file that fits another name better is that one's.
    return { file: null, several: near.length > 1 || rivals.includes(name) ? near : [] };
  }
}

/**
 * The entries with the highest score, without those that score 0.
 *
 * @param {string[]} entries
 * @param {(entry: string) => number} score
 */
function best(entries, score) {
  const most = Math.max(0, ...entries.map(score));
  return most ? entries.filter((entry) => score(entry) === most) : [];
}

/** How many parts two paths have in common at their ends. @param {string} one @param {string} other */
function common(one, other) {
  const [a, b] = [one, other].map((path) => path.split("/").reverse());
  const differs = a.findIndex((part, i) => part !== b[i]);
  return differs < 0 ? a.length : differs;
}

// For each uploaded blob, a promise of its name on the service.
/** @type {WeakMap<Blob, Promise<string>>} */
const uploads = new WeakMap();

/** Upload a file once and return the name by which a scene refers to it. @param {Blob} file @returns {Promise<string>} */
export function upload(file) {
  const known = uploads.get(file);
  if (known) return known;
  const sent = send(file);
  sent.catch(() => uploads.delete(file));
  uploads.set(file, sent);
  return sent;
}

/** @param {Blob} file */
async function send(file) {
  const bytes = await file.arrayBuffer();
  const digest = await sha256(bytes);
  const path = `/v1/assets/${digest}`;
  const known = await request(path, { method: "HEAD" }).catch((error) => {
    if (error instanceof Problem && error.status === 404) return null;
    throw error;
  });
  if (!known) await request(path, { method: "PUT", type: "application/octet-stream", body: bytes });
  return `sha256:${digest}`;
}

/**
 * Upload the files that are available and put their names on the service into the scene's text. Line numbers do not change.
 *
 * @param {string} text
 * @param {Map<string, Blob>} files - By path.
 * @returns {Promise<{text: string, names: Map<string, string[]> | null, lacking: Map<string, string>}>} `names` as
 *   from `assetNames`, null if the text is no JSON; `lacking` maps the name of a missing file to the reason.
 */
export async function withUploads(text, files) {
  let scene;
  try {
    scene = JSON.parse(text);
  } catch {
    return { text, names: null, lacking: new Map() };
  }
  const names = assetNames(scene);
  /** @type {Map<string, string>} */
  const lacking = new Map();
  for (const [name, { file, several }] of filesFor(names.keys(), files)) {
    try {
      if (file) text = named(text, name, await upload(file));
      else lacking.set(name, absent(name, several));
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      lacking.set(name, `The file ${name} cannot be used. ${error.message}`);
    }
  }
  return { text, names, lacking };
}

/** @param {string} name @param {string[]} several */
function absent(name, several) {
  return several.length
    ? `${several.join(" and ")} could be the file ${name}. Choose it below the scene.`
    : `The file ${name} is not here yet. Drop it on the page, or choose it below the scene.`;
}

/** @param {string} text @param {string} name @param {string} uploaded */
function named(text, name, uploaded) {
  const written = JSON.stringify(name).replace(/[.*+?^${}()|[\]\\/]/g, "\\$&");
  return text.replace(new RegExp(`("asset"\\s*:\\s*)${written}`, "g"), `$1"${uploaded}"`);
}
