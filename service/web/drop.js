// Files and folders dropped anywhere on the page. No view loses its work to one that is dropped by mistake.

import { notified } from "./dialog.js";
import { navigate } from "./navigation.js";

const DROPPED = "penumbra:dropped";

// A scene that was dropped on another view than the one that opens it.
let waiting = null;

/** Accept drops as long as the page is open. */
export function acceptDrops() {
  const carriesFiles = (event) => event.dataTransfer?.types.includes("Files");
  const lit = (on) => document.body.classList.toggle("dropping", on);
  const listen = (type, listener) => addEventListener(type, listener);
  listen("dragover", (event) => {
    if (!carriesFiles(event)) return;
    event.preventDefault();
    lit(true);
  });
  listen("dragleave", (event) => {
    if (event.relatedTarget === null) lit(false);
  });
  listen("drop", async (event) => {
    if (!carriesFiles(event)) return;
    event.preventDefault();
    lit(false);
    const files = await dropped(event.dataTransfer);
    if (files.size) hand(files);
  });
}

function hand(files) {
  // A view that takes the files says so by preventing the default.
  if (!dispatchEvent(new CustomEvent(DROPPED, { detail: files, cancelable: true }))) return;
  if (![...files.keys()].some(isScene))
    return notified("To render a scene, drop its JSON file, with its textures and meshes if it has any.");
  waiting = files;
  navigate("/");
}

/** Take what is dropped from now on, and a scene that was dropped on another view just before. */
export function takeDrops(onFiles, signal) {
  addEventListener(DROPPED, (event) => (event.preventDefault(), onFiles(event.detail)), { signal });
  const files = waiting;
  waiting = null;
  return files;
}

async function dropped(transfer) {
  // Entries are valid only during the event, so collect them all before the first await.
  const entries = Array.from(transfer.items, (item) => item.webkitGetAsEntry?.()).filter(Boolean);
  const files = new Map();
  if (!entries.length) for (const file of transfer.files) files.set(file.name, file);
  for (const entry of entries) await gather(entry, files);
  return files;
}

async function gather(entry, files) {
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    files.set(entry.fullPath.replace(/^\//, ""), file);
    return;
  }
  const reader = entry.createReader();
  // A reader returns entries in batches, and an empty batch at the end.
  for (
    let some;
    (some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject))).length;
  ) {
    for (const inner of some) await gather(inner, files);
  }
}

/** The chosen files by path. */
export function chosen(list) {
  return new Map(Array.from(list, (file) => [file.webkitRelativePath || file.name, file]));
}

/** Whether a file is a scene; glTF files are JSON too, but meshes. */
export const isScene = (path) => /\.json$/i.test(path);
