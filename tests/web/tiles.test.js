import assert from "node:assert/strict";
import { test } from "node:test";

import { Pace, decodeBatch } from "../../service/web/tiles.js";

test("a busy job is shown soon and again, and takes less than 10 MB in 100 s", () => {
  const [side, whole] = [512, 6 * 512 ** 2];
  for (const bytes of [2e3, 100e3, whole]) {
    // Each answer is there after 50 ms.
    const pace = new Pace(side ** 2, 0);
    let [now, sum, early] = [0, 0, 0];
    for (; now < 100e3; now += 50 + pace.after(bytes, now + 50)) {
      sum += bytes;
      if (now < 10e3) early += bytes;
    }
    assert.ok(sum < 10e6, `${sum} bytes in pieces of ${bytes}`);
    assert.ok(
      early >= (bytes === whole ? 3 : 1.5) * whole || bytes === 2e3,
      `${early} bytes at first, in pieces of ${bytes}`,
    );
  }
});

test("half floats are read with their signs and infinities", () => {
  const words = new Uint32Array([0x424d4e50, 0x00020001, 1, 7, 3, 7, 1, 4, 2, 6, 3, 1, 12]);
  const halves = new Uint16Array([0x3c00, 0xb555, 0x7c00, 0, 0x7bff, 1]);
  const { tiles, ...rest } = decodeBatch(Uint8Array.of(...bytesOf(words), ...bytesOf(halves)).buffer);
  assert.deepEqual(rest, { next: 7, complete: true, succeeded: true });
  const [{ pixels, columns, rows, x0, y1 }] = tiles;
  assert.deepEqual([columns, rows, x0, y1], [2, 1, 4, 3]);
  assert.deepEqual(Array.from(pixels), [1, -0.333251953125, Infinity, 0, 65504, 2 ** -24]);
});

/** @param {ArrayBufferView} array */
const bytesOf = (array) => new Uint8Array(array.buffer);
