// Textures and meshes: which files a scene names, and how they reach the service.

import { Problem, request } from "./api.js";
import { pointerPart } from "./json_text.js";
import { sha256 } from "./sha256.js";

const UPLOADED = /^sha256:[0-9a-f]{64}$/;

/**
 * The files that a scene names.
 *
 * @param {unknown} scene - Parsed JSON, not validated.
 * @returns {Map<string, string[]>} Pointers into the scene by the name of the file.
 */
export function assetNames(scene) {
  const names = new Map();
  const note = (pointer, asset) => {
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

/**
 * The file for each name: the one at this path, or else the one whose path has the longest end in common with it. A file
 * that fits two names equally well, or a name that two files fit, is not guessed.
 *
 * @param {Iterable<string>} names
 * @param {Map<string, Blob>} files - By path.
 * @returns {Map<string, {file: Blob | null, several: string[]}>} `several` has the paths among which to choose.
 */
export function filesFor(names, files) {
  const wanted = [...names];
  const open = wanted.filter((name) => !files.has(name));
  const taken = new Set(wanted.map((name) => files.get(name)));
  const free = [...files.keys()].filter((path) => !taken.has(files.get(path)));
  return new Map(wanted.map((name) => [name, files.has(name) ? sure(files.get(name)) : guessed(name)]));

  function guessed(name) {
    const near = best(free, (path) => common(name, path));
    const rivals = near.length === 1 ? best(open, (other) => common(other, near[0])) : [];
    if (rivals.length === 1 && rivals[0] === name) return sure(files.get(near[0]));
    // A file that fits another name better is that one's.
    return { file: null, several: near.length > 1 || rivals.includes(name) ? near : [] };
  }
}

const sure = (file) => ({ file, several: [] });

/** The entries with the highest score, without those that score 0. */
function best(entries, score) {
  const most = Math.max(0, ...entries.map(score));
  return most ? entries.filter((entry) => score(entry) === most) : [];
}

/** How many parts two paths have in common at their ends. */
function common(one, other) {
  const [a, b] = [one, other].map((path) => path.split("/").reverse());
  const differs = a.findIndex((part, i) => part !== b[i]);
  return differs < 0 ? a.length : differs;
}

// For each uploaded blob, a promise of its name on the service.
const uploads = new WeakMap();

/** Upload a file once and return the name by which a scene refers to it. */
export function upload(file) {
  if (!uploads.has(file)) {
    const sent = send(file);
    sent.catch(() => uploads.delete(file));
    uploads.set(file, sent);
  }
  return uploads.get(file);
}

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

function absent(name, several) {
  return several.length
    ? `${several.join(" and ")} could be the file ${name}. Choose it below the scene.`
    : `The file ${name} is not here yet. Drop it on the page, or choose it below the scene.`;
}

function named(text, name, uploaded) {
  const written = JSON.stringify(name).replace(/[.*+?^${}()|[\]\\/]/g, "\\$&");
  return text.replace(new RegExp(`("asset"\\s*:\\s*)${written}`, "g"), `$1"${uploaded}"`);
}
