// Follows the tiles of a job as they are finished, at a bounded number of bytes.

import { Problem, jobPath, request } from "./api.js";
import { pause } from "./dom.js";
import { PIXEL_BYTES, Pace, decodeBatch } from "./tiles.js";

const BATCHES = "application/octet-stream";
// The service keeps a request waiting for new tiles for so long.
const WAIT_SECONDS = 25;
/** Final pictures of more pixels come in half floats, after a PNG. */
export const EXACT_PIXELS = 1 << 20;

// Heads of tiles are some bytes more, and an exact picture may follow one in half floats.
const MOST_SHARE = 0.99;

/** @typedef {import("./tiles.js").Batch} Batch */

/**
 * @typedef {object} Following
 * @property {AbortSignal} signal - Aborted when nobody watches any more.
 * @property {AbortSignal} ended - Aborted when the job has ended: what follows is not held back.
 * @property {(live: boolean) => void} onConnection
 * @property {(share: number) => void} onReceived - The received share of a final picture, below 1.
 */

/**
 * Follow the tiles of a job until it ends: in half floats, and at the end once more exactly unless the picture is large.
 *
 * @param {JobDocument} job
 * @param {Following} following
 * @returns {AsyncGenerator<Batch, void>} Empty batches too.
 * @throws {Problem} If the job does not exist (any more).
 */
export async function* followTiles(job, following) {
  const { signal, ended } = following;
  const exact = job.width * job.height <= EXACT_PIXELS;
  const pace = new Pace(job.width * job.height, performance.now());
  if (!exact || !ended.aborted)
    for await (const { batch, bytes } of batches(job, "float16", following)) {
      yield batch;
      if (batch.complete && !(exact && batch.succeeded)) return;
      if (!batch.complete && !ended.aborted) await pause(pace.after(bytes, performance.now()), ended);
      if (exact && ended.aborted) break;
    }
  if (exact && !signal.aborted) for await (const { batch } of batches(job, "float32", following)) yield batch;
}

/**
 * All batches of a job. After a lost connection they continue from the last cursor.
 *
 * @param {JobDocument} job
 * @param {"float16" | "float32"} encoding
 * @param {Following} following
 * @returns {AsyncGenerator<{batch: Batch, bytes: number}, void>}
 */
async function* batches({ id, width, height }, encoding, { signal, onConnection, onReceived }) {
  const whole = width * height * PIXEL_BYTES * (encoding === "float16" ? 1 : 2);
  let [after, failures, received] = [0, 0, 0];
  const onBytes = (/** @type {number} */ more) =>
    onReceived(Math.min(MOST_SHARE, (received += more) / whole));
  while (!signal.aborted) {
    let buffer;
    try {
      const path = `${jobPath(id)}/tiles?after=${after}&wait=${WAIT_SECONDS}&encoding=${encoding}`;
      buffer = await counted(await request(path, { accept: BATCHES, signal }), onBytes);
    } catch (error) {
      if (signal.aborted) return;
      if (error instanceof Problem && error.status < 500 && error.status !== 429) throw error;
      onConnection(false);
      await pause(Math.min(5000, 250 * 2 ** failures++), signal);
      continue;
    }
    failures = 0;
    onConnection(true);
    const batch = decodeBatch(buffer);
    after = batch.next;
    yield { batch, bytes: buffer.byteLength };
    if (batch.complete) return;
  }
}

/** The body of a response. @param {Response} response @param {(bytes: number) => void} onBytes - Hears of each piece. */
function counted(response, onBytes) {
  const counter = new TransformStream({
    transform(piece, controller) {
      onBytes(piece.byteLength);
      controller.enqueue(piece);
    },
  });
  return new Response(response.body?.pipeThrough(counter)).arrayBuffer();
}
