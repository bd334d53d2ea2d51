// One job, shared by the panels of its page: a single reader of its tiles, which sends events to all of them.

import { Problem, followTiles, get, jobPath } from "./api.js";
import { pause } from "./dom.js";

// The document of the job is fetched at most this often: nothing on the page needs it sooner.
const REFRESH_MS = 250;

// A job that nothing happens to may still be deleted elsewhere.
const LOOK_MS = 5000;

export const FINAL = new Set(["succeeded", "failed", "cancelled", "expired", "deleted"]);

/**
 * Events: `job` (detail: the job's document), `tiles` (detail: a batch of `decodeBatch`), `connection` (detail: true
 * while the service answers), `gone` (the job was deleted; its state is then `deleted`), `locked` (the session has ended and
 * nothing more is asked).
 */
export class Watch extends EventTarget {
  #life = new AbortController();
  #stale = false;
  #refreshing = false;

  constructor(job) {
    super();
    this.id = job.id;
    this.job = job;
    this.live = true;
  }

  /** Aborted by `stop`; panels pass it to their listeners and requests. */
  get signal() {
    return this.#life.signal;
  }

  get final() {
    return FINAL.has(this.job.state);
  }

  on(type, listener) {
    this.addEventListener(type, (event) => listener(event.detail), { signal: this.signal });
  }

  async start() {
    this.#look();
    try {
      const options = { signal: this.signal, onConnection: (live) => this.#connection(live) };
      for await (const batch of followTiles(this.id, options)) {
        this.#emit("tiles", batch);
        this.refresh();
      }
      await this.refresh();
    } catch (error) {
      this.#end(error);
    }
  }

  async #look() {
    while (!this.signal.aborted && !this.final) {
      await pause(LOOK_MS, this.signal);
      if (!document.hidden) await this.refresh();
    }
  }

  /** End after an error of the service that trying again does not cure. */
  #end(error) {
    if (this.signal.aborted) return;
    if (error.status === 404) {
      this.job = { ...this.job, state: "deleted", paused: false, rendering: [] };
      this.#emit("job", this.job);
      this.#emit("gone", error);
    } else this.#emit("locked", error);
    this.stop();
  }

  stop() {
    this.#life.abort();
  }

  /** Fetch the job's document again, soon. */
  async refresh() {
    this.#stale = true;
    if (this.#refreshing) return;
    this.#refreshing = true;
    try {
      while (this.#stale && !this.signal.aborted) {
        this.#stale = false;
        await this.#fetch();
        await pause(REFRESH_MS, this.signal);
      }
    } finally {
      this.#refreshing = false;
    }
  }

  async #fetch() {
    try {
      this.job = await get(jobPath(this.id), { signal: this.signal });
      this.#emit("job", this.job);
    } catch (error) {
      if (error instanceof Problem && [401, 403, 404].includes(error.status)) this.#end(error);
      else if (!this.signal.aborted) this.#stale = true;
    }
  }

  #connection(live) {
    if (live === this.live) return;
    this.live = live;
    this.#emit("connection", live);
  }

  #emit(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
