// One job, shared by the panels of its page: a single reader of its tiles, which sends events to all of them.

import { Problem, get, jobPath } from "./api.js";
import { Emitter, pause } from "./dom.js";
import { EXACT_PIXELS, followTiles } from "./following.js";

// The document of the job is fetched at most this often: nothing on the page needs it sooner.
const REFRESH_MS = 250;

// A job that nothing happens to may still be deleted elsewhere.
const LOOK_MS = 5000;
// Tiles may be held back while the progress of a running job is shown.
const RUNNING_MS = 1000;

export const FINAL = new Set(["succeeded", "failed", "cancelled", "expired", "deleted"]);

/**
 * @typedef {object} WatchEvents
 * @property {JobDocument} job - As it is now.
 * @property {import("./tiles.js").Batch} tiles
 * @property {string} preview - Address of the final picture as PNG: its linear values are larger, and come after it.
 * @property {number} received - The received share of a final picture; 1 when nothing more comes.
 * @property {boolean} connection - Whether the service answers.
 * @property {Problem} gone - The job was deleted; its state is then `deleted`.
 * @property {Problem} lost - Files of its picture are damaged: nothing more comes.
 * @property {Problem} locked - The session has ended and nothing more is asked.
 */

/** A job, whose panels pass its signal to their listeners and requests. @extends {Emitter<WatchEvents>} */
export class Watch extends Emitter {
  #ended = new AbortController();
  #stale = false;
  #refreshing = false;

  /** @param {JobDocument} job */
  constructor(job) {
    super();
    this.id = job.id;
    this.job = job;
    this.live = true;
    if (this.final) this.#ended.abort();
  }

  get final() {
    return FINAL.has(this.job.state);
  }

  async start() {
    this.#look();
    try {
      if (this.job.state === "succeeded" && this.job.width * this.job.height > EXACT_PIXELS)
        await this.#preview();
      const following = {
        signal: this.signal,
        ended: this.#ended.signal,
        onConnection: this.#connection,
        onReceived: (/** @type {number} */ share) => this.emit("received", share),
      };
      for await (const batch of followTiles(this.job, following)) {
        this.emit("tiles", batch);
        this.refresh();
      }
      await this.refresh();
      this.emit("received", 1);
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      this.emit("received", 1);
      // What has become of it is in its document.
      if (error.status === 410) await this.#fetch();
      this.#end(error);
    }
  }

  async #preview() {
    const picture = new Image();
    picture.src = this.job.links.image_png;
    await picture.decode().catch(() => {});
    this.emit("preview", picture.src);
  }

  async #look() {
    while (!this.signal.aborted && !this.final) {
      await pause(this.job.state === "running" ? RUNNING_MS : LOOK_MS, this.signal);
      if (!document.hidden) await this.refresh();
    }
  }

  /** End after an error of the service that trying again does not cure. @param {Problem} error */
  #end(error) {
    if (this.signal.aborted) return;
    if (error.status === 404) {
      this.job = { ...this.job, state: /** @type {const} */ ("deleted"), paused: false, rendering: [] };
      this.emit("job", this.job);
      this.emit("gone", error);
    } else this.emit(error.status === 410 ? "lost" : "locked", error);
    this.stop();
  }

  stop() {
    this.life.abort();
    this.#ended.abort();
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
      this.emit("job", this.job);
      if (this.final) this.#ended.abort();
    } catch (error) {
      if (error instanceof Problem && [401, 403, 404].includes(error.status)) this.#end(error);
      else if (!this.signal.aborted) this.#stale = true;
    }
  }

  #connection = (/** @type {boolean} */ live) => {
    if (live === this.live) return;
    this.live = live;
    this.emit("connection", live);
  };
}
