// Accepts files and folders dropped anywhere on the page.

/** @param {(files: Map<string, File>) => void} onFiles - By path, relative to what was dropped. */
export function acceptDrops(onFiles, signal) {
  const carriesFiles = (event) => event.dataTransfer?.types.includes("Files");
  const lit = (on) => document.body.classList.toggle("dropping", on);
  const listen = (type, listener) => addEventListener(type, listener, { signal });
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
    if (files.size && !signal.aborted) onFiles(files);
  });
  signal.addEventListener("abort", () => lit(false));
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
