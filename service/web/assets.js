// Textures and meshes: which files a scene names, and how they reach the service.

import { Problem, request } from "./api.js";
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
    note(`/textures/${name.replaceAll("~", "~0").replaceAll("/", "~1")}/asset`, texture?.asset);
  }
  if (Array.isArray(scene?.shapes))
    scene.shapes.forEach((shape, i) => note(`/shapes/${i}/asset`, shape?.asset));
  return names;
}

/** The file for a name: the one at this path, or else one with the same base name. */
export function fileFor(name, files) {
  const last = (path) => path.slice(path.lastIndexOf("/") + 1);
  if (files.has(name)) return files.get(name);
  for (const [path, file] of files) if (last(path) === last(name)) return file;
  return null;
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
 * @returns {Promise<{text: string, names: Map<string, string[]>, lacking: Map<string, string>}>} `names` as
 *   from `assetNames`; `lacking` maps the name of a missing file to the reason.
 */
export async function withUploads(text, files) {
  let scene;
  try {
    scene = JSON.parse(text);
  } catch {
    return { text, names: new Map(), lacking: new Map() };
  }
  const names = assetNames(scene);
  const lacking = new Map();
  for (const name of names.keys()) {
    const file = fileFor(name, files);
    try {
      if (file) text = named(text, name, await upload(file));
      else
        lacking.set(
          name,
          `The file ${name} is not here yet. Drop it on the page, or choose it below the scene.`,
        );
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      lacking.set(name, `The file ${name} cannot be used. ${error.message}`);
    }
  }
  return { text, names, lacking };
}

function named(text, name, uploaded) {
  const written = JSON.stringify(name).replace(/[.*+?^${}()|[\]\\/]/g, "\\$&");
  return text.replace(new RegExp(`("asset"\\s*:\\s*)${written}`, "g"), `$1"${uploaded}"`);
}
