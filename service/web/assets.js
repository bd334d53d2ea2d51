// Textures and meshes: which files a scene names, and how they reach the service.

import { Problem, request } from "./api.js";
import { places, pointerPart } from "./json_text.js";
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

/** @typedef {{file: Blob | StoredFile | null, several: string[]}} Found `several` has the paths among which to choose. */

/**
 * The file for each name: the one at this path, or else the one whose path has the longest end in common with it. A file
 * that fits two names equally well, or a name that two files fit, is not guessed.
 *
 * @param {Iterable<string>} names
 * @param {Map<string, Blob | StoredFile>} files - By path.
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

/** A file that was uploaded before the page was loaded again: its bytes are on the service alone. */
export class StoredFile {
  /** @param {string} digest @param {number} size */
  constructor(digest, size) {
    this.digest = digest;
    this.size = size;
  }
}

// For each file, a promise of its SHA-256 on the service, and that of the finished ones.
/** @type {WeakMap<Blob | StoredFile, Promise<string>>} */
const uploads = new WeakMap();
/** @type {WeakMap<Blob | StoredFile, string>} */
const digests = new WeakMap();

/** The SHA-256 of a file that the service has, or null. @param {Blob | StoredFile} file */
export const digestOf = (file) => digests.get(file) ?? null;

/** Upload a file once and return the name by which a scene refers to it. @param {Blob | StoredFile} file @returns {Promise<string>} */
export async function upload(file) {
  const sent = uploads.get(file) ?? (file instanceof StoredFile ? found(file) : send(file));
  uploads.set(file, sent);
  try {
    const digest = await sent;
    digests.set(file, digest);
    return `sha256:${digest}`;
  } catch (error) {
    uploads.delete(file);
    throw error;
  }
}

/** @param {Blob} file */
async function send(file) {
  const bytes = await file.arrayBuffer();
  const digest = await sha256(bytes);
  if (!(await isThere(digest)))
    await request(`/v1/assets/${digest}`, { method: "PUT", type: "application/octet-stream", body: bytes });
  return digest;
}

/** @param {StoredFile} file */
async function found({ digest }) {
  if (await isThere(digest)) return digest;
  throw new Problem(404, { detail: "The service no longer has it. Choose it again." });
}

/** @param {string} digest */
async function isThere(digest) {
  try {
    await request(`/v1/assets/${digest}`, { method: "HEAD" });
    return true;
  } catch (error) {
    if (error instanceof Problem && error.status === 404) return false;
    throw error;
  }
}

/**
 * Upload the files that are available and put their names on the service into the scene's text. Line numbers do not change.
 *
 * @param {string} text
 * @param {Map<string, Blob | StoredFile>} files - By path.
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
  /** @type {Map<string, string>} */
  const uploaded = new Map();
  for (const [name, { file, several }] of filesFor(names.keys(), files)) {
    try {
      if (file) for (const pointer of names.get(name) ?? []) uploaded.set(pointer, await upload(file));
      else lacking.set(name, absent(name, several));
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      lacking.set(name, `The file ${name} cannot be used. ${error.message}`);
    }
  }
  return { text: replaced(text, uploaded), names, lacking };
}

/** @param {string} name @param {string[]} several */
function absent(name, several) {
  return several.length
    ? `${several.join(" and ")} could be the file ${name}. Choose it below the scene.`
    : `The file ${name} is not here yet. Drop it on the page, or choose it below the scene.`;
}

/** Replace values of a JSON text, however they are spelled. @param {string} text @param {Map<string, string>} values - By pointer. */
function replaced(text, values) {
  const spans = [...places(text, values.keys())].sort(([, one], [, other]) => other.value - one.value);
  for (const [pointer, { value, end }] of spans)
    text = text.slice(0, value) + JSON.stringify(values.get(pointer)) + text.slice(end);
  return text;
}
