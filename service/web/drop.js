// Files and folders dropped anywhere on the page. No view loses its work to one that is dropped by mistake.

import { notified } from "./dialog.js";
import { navigate } from "./navigation.js";
import { unzipped } from "./zip.js";

const DROPPED = "penumbra:dropped";

/** @typedef {Map<string, File>} Files By path. */

// A scene that was dropped on another view than the one that opens it.
/** @type {Files | null} */
let waiting = null;

/** Accept drops as long as the page is open. */
export function acceptDrops() {
  const carriesFiles = (/** @type {DragEvent} */ event) => event.dataTransfer?.types.includes("Files");
  const lit = (/** @type {boolean} */ on) => document.body.classList.toggle("dropping", on);
  addEventListener("dragover", (event) => {
    if (!carriesFiles(event)) return;
    event.preventDefault();
    lit(true);
  });
  addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) lit(false);
  });
  addEventListener("drop", async (event) => {
    if (!event.dataTransfer || !carriesFiles(event)) return;
    event.preventDefault();
    lit(false);
    const files = await unpacked(await dropped(event.dataTransfer));
    if (files.size) hand(files);
  });
}

/** @param {Files} files */
function hand(files) {
  // A view that takes the files says so by preventing the default.
  if (!dispatchEvent(new CustomEvent(DROPPED, { detail: files, cancelable: true }))) return;
  if (![...files.keys()].some(isScene))
    return notified("To render a scene, drop its JSON file with its textures and meshes, or a ZIP of them.");
  waiting = files;
  navigate("/");
}

/**
 * Take what is dropped from now on.
 *
 * @param {(files: Files) => void} onFiles
 * @param {AbortSignal} signal
 * @returns {Files | null} A scene that was dropped on another view just before.
 */
export function takeDrops(onFiles, signal) {
  const taken = (/** @type {Event} */ event) => {
    event.preventDefault();
    onFiles(/** @type {CustomEvent<Files>} */ (event).detail);
  };
  addEventListener(DROPPED, taken, { signal });
  const files = waiting;
  waiting = null;
  return files;
}

/** @param {DataTransfer} transfer */
async function dropped(transfer) {
  // Entries are valid only during the event, so collect them all before the first await.
  const entries = Array.from(transfer.items, (item) => item.webkitGetAsEntry?.() ?? []).flat();
  /** @type {Files} */
  const files = new Map();
  if (!entries.length) for (const file of transfer.files) files.set(file.name, file);
  for (const entry of entries) await gather(entry, files);
  return files;
}

/** @param {FileSystemEntry} entry @param {Files} files */
async function gather(entry, files) {
  if (entry.isFile) {
    const one = /** @type {FileSystemFileEntry} */ (entry);
    const file = await /** @type {Promise<File>} */ (new Promise((done, failed) => one.file(done, failed)));
    files.set(entry.fullPath.replace(/^\//, ""), file);
    return;
  }
  const reader = /** @type {FileSystemDirectoryEntry} */ (entry).createReader();
  const read = () =>
    /** @type {Promise<FileSystemEntry[]>} */ (
      new Promise((done, failed) => reader.readEntries(done, failed))
    );
  // A reader returns entries in batches, and an empty batch at the end.
  for (let some; (some = await read()).length;) for (const inner of some) await gather(inner, files);
}

/** Files with what is in archives in place of these; one that cannot be opened is named. @param {Files} files @returns {Promise<Files>} */
export async function unpacked(files) {
  /** @type {Files} */
  const all = new Map();
  for (const [path, file] of files) {
    try {
      const inner = /\.zip$/i.test(path) ? await unzipped(file) : new Map([[path, file]]);
      for (const [name, content] of inner) all.set(name, content);
    } catch (error) {
      const reason = error instanceof RangeError ? error.message : "It is damaged.";
      await notified(`${path} cannot be opened. ${reason}`);
    }
  }
  return all;
}

/** The chosen files by path. @param {Iterable<File> | ArrayLike<File> | null} list @returns {Files} */
export function chosen(list) {
  return new Map(Array.from(list ?? [], (file) => [file.webkitRelativePath || file.name, file]));
}

/** Whether a file is a scene; glTF files are JSON too, but meshes. @param {string} path */
export const isScene = (path) => /\.json$/i.test(path);
