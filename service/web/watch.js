// One job, shared by the panels of its page: a single reader of its tiles, which sends events to all of them.

import { Problem, followTiles, get, jobPath } from "./api.js";
import { pause } from "./dom.js";

// The document of the job is fetched at most this often: nothing on the page needs it sooner.
const REFRESH_MS = 250;

export const FINAL = new Set(["succeeded", "failed", "cancelled", "expired"]);

/**
 * Events: `job` (detail: the job's document), `tiles` (detail: a batch of `decodeBatch`), `connection` (detail: true
 * while the service answers), `gone` (the job was deleted).
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
    try {
      const options = { signal: this.signal, onConnection: (live) => this.#connection(live) };
      for await (const batch of followTiles(this.id, options)) {
        this.#emit("tiles", batch);
        this.refresh();
      }
      await this.refresh();
    } catch (error) {
      if (!this.signal.aborted) this.#emit("gone", error);
    }
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
      if (error instanceof Problem && error.status === 404) this.#emit("gone", error);
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
