// Requests to the service that this page came from, and its errors as exceptions.

import { pause } from "./dom.js";
import { admitted, begunSessions } from "./session.js";

/** An error response of the service (RFC 9457). */
export class Problem extends Error {
  /** @param {number} status @param {ProblemDocument} document @param {number | null} retryAfter - Seconds. */
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

/** What to say about an exception. @param {unknown} error */
export const messageOf = (error) => (error instanceof Error ? error.message : String(error));

/** The service did not answer at all. */
export class Unreachable extends Error {
  /** @param {unknown} cause */
  constructor(cause) {
    super("The service does not answer.", { cause });
    this.name = "Unreachable";
  }
}

/** @typedef {{method?: string, body?: BodyInit, type?: string, accept?: string, signal?: AbortSignal}} RequestOptions */

/**
 * Make a request.
 *
 * @param {string} path - On this server.
 * @param {RequestOptions} options
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

/** @param {string} path @param {RequestOptions} options */
async function sent(path, { method = "GET", body, type, accept, signal }) {
  /** @type {Record<string, string>} */
  const headers = {};
  if (type) headers["Content-Type"] = type;
  if (accept) headers.Accept = accept;
  try {
    return await fetch(path, { method, body, headers, signal, credentials: "same-origin" });
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw new Unreachable(error);
  }
}

/**
 * Get a document.
 *
 * @template Document
 * @param {string} path
 * @param {{signal?: AbortSignal}} options
 * @returns {Promise<Document>}
 */
export async function get(path, { signal } = {}) {
  return (await request(path, { signal, accept: "application/json" })).json();
}

/**
 * Post JSON and get a document, or null where the service has nothing to say.
 *
 * @template Document
 * @param {string} path
 * @param {unknown} value - JSON text as a string: lines and columns of problems then refer to it.
 * @param {{signal?: AbortSignal}} options
 * @returns {Promise<Document>}
 */
export async function post(path, value, { signal } = {}) {
  const body = typeof value === "string" ? value : JSON.stringify(value);
  const response = await request(path, { method: "POST", type: "application/json", body, signal });
  return response.status === 204 ? /** @type {any} */ (null) : response.json();
}

/** Get a response body as text. @param {string} path @param {{signal?: AbortSignal}} options */
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

/** @param {string} id */
export const jobPath = (id) => `/v1/jobs/${encodeURIComponent(id)}`;
