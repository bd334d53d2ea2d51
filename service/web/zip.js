// ZIP archives: the files in one. The browser itself inflates.

// Signatures and lengths of records, and where their fields stand: APPNOTE.TXT, 4.3.
const END = { signature: 0x06054b50, length: 22, count: 10, first: 16 };
const ENTRY = {
  signature: 0x02014b50,
  length: 46,
  flags: 8,
  method: 10,
  packed: 20,
  size: 24,
  name: 28,
  extra: 30,
  comment: 32,
  local: 42,
};
const LOCAL = { length: 30, name: 26, extra: 28 };
const LONGEST_COMMENT = 0xffff;
const ENCRYPTED = 1;
const STORED = 0;
const DEFLATED = 8;
// Bytes of all files together: what a tab holds without trouble, and archives made to fill memory exceed.
const MOST_BYTES = 1 << 29;

/**
 * Unpack an archive. Folders, hidden files, and those that macOS adds are left out.
 *
 * @param {File} archive
 * @returns {Promise<Map<string, File>>} By path.
 * @throws {RangeError} If it is damaged, encrypted or too large.
 */
export async function unzipped(archive) {
  const view = new DataView(await archive.arrayBuffer());
  /** @type {Map<string, File>} */
  const files = new Map();
  let room = MOST_BYTES;
  for (const entry of entries(view)) {
    const path = new TextDecoder().decode(
      bytes(view, entry + ENTRY.length, view.getUint16(entry + ENTRY.name, true)),
    );
    if (/(^|\/)(\.|__MACOSX\/)|\/$/.test(path)) continue;
    const size = view.getUint32(entry + ENTRY.size, true);
    if ((room -= size) < 0) throw new RangeError("Its files are too large together.");
    files.set(path, new File(await parts(content(view, entry), size), path.slice(path.lastIndexOf("/") + 1)));
  }
  return files;
}

/** @param {DataView<ArrayBuffer>} view @param {number} start @param {number} length */
const bytes = (view, start, length) => new Uint8Array(view.buffer, start, length);

/** Where the entries of an archive stand. @param {DataView<ArrayBuffer>} view */
function* entries(view) {
  let end = view.byteLength - END.length;
  const last = Math.max(0, end - LONGEST_COMMENT);
  while (end >= last && view.getUint32(end, true) !== END.signature) end--;
  if (end < last) throw new RangeError("It has no end.");
  let entry = view.getUint32(end + END.first, true);
  for (let left = view.getUint16(end + END.count, true); left; left--) {
    if (view.getUint32(entry, true) !== ENTRY.signature) throw new RangeError("It is damaged.");
    yield entry;
    const rest = [ENTRY.name, ENTRY.extra, ENTRY.comment].map((field) => view.getUint16(entry + field, true));
    entry += rest.reduce((sum, length) => sum + length, ENTRY.length);
  }
}

/** @param {DataView<ArrayBuffer>} view @param {number} entry @returns {ReadableStream<Uint8Array<ArrayBuffer>>} */
function content(view, entry) {
  const method = view.getUint16(entry + ENTRY.method, true);
  if (view.getUint16(entry + ENTRY.flags, true) & ENCRYPTED) throw new RangeError("It is encrypted.");
  if (method !== STORED && method !== DEFLATED) throw new RangeError("Its files are not packed by Deflate.");
  const local = view.getUint32(entry + ENTRY.local, true);
  const names = view.getUint16(local + LOCAL.name, true) + view.getUint16(local + LOCAL.extra, true);
  const packed = bytes(view, local + LOCAL.length + names, view.getUint32(entry + ENTRY.packed, true));
  const stream = new Blob([packed]).stream();
  return method === STORED ? stream : stream.pipeThrough(new DecompressionStream("deflate-raw"));
}

/** The parts of a stream, which may be no longer than declared. @param {ReadableStream<Uint8Array<ArrayBuffer>>} stream @param {number} size */
async function parts(stream, size) {
  const read = [];
  const reader = stream.getReader();
  for (let part; !(part = await reader.read()).done; read.push(part.value))
    if ((size -= part.value.length) < 0) throw new RangeError("It is damaged.");
  return read;
}
