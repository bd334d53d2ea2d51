import assert from "node:assert/strict";
import { test } from "node:test";

import {
  Encoder,
  INFINITE,
  TRANSFERS,
  bitsOf,
  code,
  valueOf,
} from "../../service/web/views/picture/transfer.js";

/** Codes of single numbers, as grey. */
function codesOf(encoder, values) {
  const packed = new Uint32Array(values.length);
  encoder.writeGrey(new Uint32Array(Float32Array.from(values).buffer), 0, 1, packed, 0, values.length);
  return Array.from(packed, (word) => word & 255);
}

/** The neighbours of a float, and itself. */
const around = (value) => [-1, 0, 1].map((step) => valueOf(Math.max(0, bitsOf(value) + step)));

for (const transfer of Object.keys(TRANSFERS))
  for (const exposure of [0, 0.7, -9.5, 20])
    test(`the table of ${transfer} at ${exposure} stops has the code of every number near a threshold`, () => {
      const thresholds = Array.from({ length: 1025 }, (_, i) => (i / 1024) ** 2.4 * 2 ** -exposure);
      const values = [...thresholds.flatMap(around), 0, -0, -1, 1e-45, 3.4e38, Infinity, -Infinity, NaN];
      const expected = values.map((value) => code(Math.fround(value), exposure, transfer));
      assert.deepEqual(codesOf(new Encoder(exposure, transfer), values), expected);
    });

test("RGB pixels become opaque words with red in the lowest byte", () => {
  const packed = new Uint32Array(2);
  const bits = new Uint32Array(Float32Array.of(0, 0.5, 1, 2, -1, NaN).buffer);
  new Encoder(0, "linear").write(bits, 0, packed, 0, 2);
  assert.deepEqual(Array.from(packed), [0xffff8000, 0xff0000ff]);
});

test("infinity is the first float without a code of its own", () => {
  assert.equal(valueOf(INFINITE), Infinity);
  assert.ok(Number.isFinite(valueOf(INFINITE - 1)));
});
