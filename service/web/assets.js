// Textures and meshes: which files a scene names, and how they reach the service.

import { Problem, request } from "./api.js";
import { sha256 } from "./sha256.js";

const UPLOADED = /^sha256:[0-9a-f]{64}$/;

/**
 * The files that a scene names.
 *
 * @param {unknown} scene - As it was parsed, of whatever form.
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

/** The file for a name: the one of this path, or else one whose own name is the same. */
export function fileFor(name, files) {
  const last = (path) => path.slice(path.lastIndexOf("/") + 1);
  if (files.has(name)) return files.get(name);
  for (const [path, file] of files) if (last(path) === last(name)) return file;
  return null;
}

// Blobs that the service has, by the promise of their names there.
const uploads = new WeakMap();

/** Send a file to the service unless it was sent before; give the name under which a scene finds it there. */
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
 * A scene's text with the files that are at hand uploaded and named as the service names them. Lines stay where they are.
 *
 * @returns {Promise<{text: string, names: Map<string, string[]>, lacking: Map<string, string>}>} `names` as `assetNames`
 *   gives them, `lacking` why a file is not there, by its name.
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
          `The file ${name} is not here yet. Drop it on the page, or choose it under the scene.`,
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
