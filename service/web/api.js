// Requests to the service that this page came from, and its errors as exceptions.

import { pause } from "./dom.js";
import { admitted, begunSessions } from "./session.js";

/** An error response of the service (RFC 9457). */
export class Problem extends Error {
  constructor(status, document = {}, retryAfter = null) {
    super(
      document.detail || document.errors?.[0]?.detail || document.title || `The service answered ${status}.`,
    );
    this.name = "Problem";
    this.status = status;
    this.code = document.code;
    this.errors = document.errors ?? [];
    this.more = document.more ?? 0;
    this.retryAfter = retryAfter;
  }
}

/** The service did not answer at all. */
export class Unreachable extends Error {
  constructor(cause) {
    super("The service does not answer.", { cause });
    this.name = "Unreachable";
  }
}

/**
 * Make a request.
 *
 * @param {string} path - On this server.
 * @param {{method?: string, body?: BodyInit, type?: string, accept?: string, signal?: AbortSignal}} options
 * @returns {Promise<Response>} The answer, with a status below 400.
 * @throws {Problem | Unreachable | DOMException} AbortError when the signal is aborted.
 */
export async function request(path, options = {}) {
  const before = begunSessions();
  let response = await sent(path, options);
  if (response.status === 401 && (await admitted(before)) && !options.signal?.aborted)
    response = await sent(path, options);
  if (response.ok || response.status === 304) return response;
  const document = await response.json().catch(() => ({}));
  throw new Problem(response.status, document, Number(response.headers.get("Retry-After")) || null);
}

async function sent(path, { method = "GET", body, type, accept, signal }) {
  const headers = {};
  if (type) headers["Content-Type"] = type;
  if (accept) headers.Accept = accept;
  try {
    return await fetch(path, { method, body, headers, signal, credentials: "same-origin" });
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Unreachable(error);
  }
}

export async function get(path, { signal } = {}) {
  return (await request(path, { signal, accept: "application/json" })).json();
}

/** Post JSON: a value, or JSON text, whose lines and columns the problems then refer to. */
export async function post(path, value, { signal } = {}) {
  const body = typeof value === "string" ? value : JSON.stringify(value);
  return (await request(path, { method: "POST", type: "application/json", body, signal })).json();
}

/** Get a response body as text. */
export async function text(path, { signal } = {}) {
  return (await request(path, { signal })).text();
}

// Before a busy service is asked again, unless it sends Retry-After.
const RETRY_SECONDS = 2;

/**
 * Repeat a request while the service is too busy to answer it.
 *
 * @template T
 * @param {() => Promise<T>} ask
 * @param {AbortSignal} signal
 * @param {() => void} [onBusy]
 * @returns {Promise<T>}
 */
export async function whenFree(ask, signal, onBusy = () => {}) {
  while (true) {
    try {
      return await ask();
    } catch (error) {
      if (!(error instanceof Problem) || (error.status !== 429 && error.status !== 503)) throw error;
      onBusy();
      await pause(1000 * (error.retryAfter ?? RETRY_SECONDS), signal);
      signal.throwIfAborted();
    }
  }
}

export const jobPath = (id) => `/v1/jobs/${encodeURIComponent(id)}`;

const BATCHES = "application/octet-stream";
const HEAD = 20;
const TILE_HEAD = 32;

/**
 * Read a binary batch of tiles.
 *
 * @param {ArrayBuffer} buffer
 * @returns {{next: number, complete: boolean, succeeded: boolean, tiles: object[]}} Each tile has `seq`, `pass`, `x0`,
 *   `y0`, `x1`, `y1`, `stride`, `columns`, `rows`, and its `pixels` as a view into the buffer: linear RGB as
 *   Float32Array, or displayed RGB as Uint8Array.
 */
export function decodeBatch(buffer) {
  const view = new DataView(buffer);
  const word = (offset) => view.getUint32(offset, true);
  if (word(0) !== 0x424d4e50 || view.getUint16(4, true) !== 1)
    throw new Error("This is not a batch of tiles.");
  const linear = view.getUint16(6, true) === 0;
  const tiles = [];
  let offset = HEAD;
  for (let i = 0; i < word(8); i++) {
    const [seq, pass, x0, y0, x1, y1, stride, length] = Array.from({ length: 8 }, (_, k) =>
      word(offset + 4 * k),
    );
    offset += TILE_HEAD;
    const pixels = linear
      ? new Float32Array(buffer, offset, length / 4)
      : new Uint8Array(buffer, offset, length);
    const columns = Math.ceil((x1 - x0) / stride);
    const rows = Math.ceil((y1 - y0) / stride);
    tiles.push({ seq, pass, x0, y0, x1, y1, stride, columns, rows, pixels });
    offset += length;
  }
  const flags = word(16);
  return { next: word(12), complete: (flags & 1) !== 0, succeeded: (flags & 2) !== 0, tiles };
}

/**
 * Follow the tiles of a job until it ends. After a lost connection it resumes from the last cursor.
 *
 * @param {string} id
 * @param {{after?: number, encoding?: "float32" | "rgb8", wait?: number, signal: AbortSignal,
 *   onConnection?: (live: boolean) => void}} options
 * @yields {object} Batches as `decodeBatch` reads them, empty ones too.
 * @throws {Problem} If the job does not exist (any more).
 */
export async function* followTiles(
  id,
  { after = 0, encoding = "float32", wait = 25, signal, onConnection = () => {} },
) {
  let failures = 0;
  while (!signal.aborted) {
    let batch;
    try {
      const path = `${jobPath(id)}/tiles?after=${after}&wait=${wait}&encoding=${encoding}`;
      const response = await request(path, { accept: BATCHES, signal });
      batch = decodeBatch(await response.arrayBuffer());
    } catch (error) {
      if (signal.aborted) return;
      if (error instanceof Problem && error.status < 500 && error.status !== 429) throw error;
      onConnection(false);
      await pause(Math.min(5000, 250 * 2 ** failures++), signal);
      continue;
    }
    if (failures) failures = 0;
    onConnection(true);
    after = batch.next;
    yield batch;
    if (batch.complete) return;
  }
}
