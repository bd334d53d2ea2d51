import assert from "node:assert/strict";
import { test } from "node:test";

import { colorsOf } from "../../service/web/views/compare/references.js";
import { decodeNpy, half } from "../../service/web/views/picture/npy.js";

/** A file as NumPy writes it, version 1 or 2. */
function npy(descr, shape, numbers, { fortran = "False", version = 1 } = {}) {
  const start = version === 1 ? 10 : 12;
  const sides = shape.length === 1 ? `${shape[0]},` : shape.join(", ");
  const text = `{'descr': '${descr}', 'fortran_order': ${fortran}, 'shape': (${sides}), }`;
  const head = text.padEnd(Math.ceil((start + text.length + 1) / 64) * 64 - start - 1) + "\n";
  const bytes = new Uint8Array(start + head.length + numbers.byteLength);
  bytes.set([0x93, 78, 85, 77, 80, 89, version, 0]);
  const view = new DataView(bytes.buffer);
  if (version === 1) view.setUint16(8, head.length, true);
  else view.setUint32(8, head.length, true);
  bytes.set(new TextEncoder().encode(head), start);
  bytes.set(new Uint8Array(numbers.buffer), start + head.length);
  return bytes.buffer;
}

test("float32 values are read as they are", () => {
  const { shape, values } = decodeNpy(npy("<f4", [1, 1, 3], Float32Array.of(0.1, 7, NaN)));
  assert.deepEqual(shape, [1, 1, 3]);
  assert.deepEqual(Array.from(values), [Math.fround(0.1), 7, NaN]);
});

for (const [descr, Kind] of [
  ["<f8", Float64Array],
  ["<i4", Int32Array],
  ["|u1", Uint8Array],
  ["<u2", Uint16Array],
])
  test(`${descr} values are read as they are`, () => {
    const { values, shape } = decodeNpy(npy(descr, [3], Kind.of(1, 2, 200)));
    assert.deepEqual([shape, Array.from(values)], [[3], [1, 2, 200]]);
  });

test("big-endian values are turned round", () => {
  const numbers = new DataView(new ArrayBuffer(8));
  numbers.setFloat32(0, 1.5);
  numbers.setFloat32(4, -2);
  const { values } = decodeNpy(npy(">f4", [2], numbers));
  assert.deepEqual(Array.from(values), [1.5, -2]);
});

test("half floats have their value", () => {
  const cases = [
    [0x3c00, 1],
    [0xc000, -2],
    [0x7bff, 65504],
    [0x0001, 2 ** -24],
    [0x8000, -0],
    [0x7c00, Infinity],
    [0x7e00, NaN],
  ];
  for (const [bits, value] of cases) assert.equal(half(bits), value);
  assert.deepEqual(Array.from(decodeNpy(npy("<f2", [1], Uint16Array.of(0x3555))).values), [0.333251953125]);
});

test("an array whose first index changes fastest is read by rows", () => {
  const columns = Float32Array.of(1, 4, 2, 5, 3, 6);
  const { values } = decodeNpy(npy("<f4", [2, 3], columns, { fortran: "True" }));
  assert.deepEqual(Array.from(values), [1, 2, 3, 4, 5, 6]);
});

test("a head of version 2 is read", () => {
  assert.deepEqual(Array.from(decodeNpy(npy("<f4", [1], Float32Array.of(3), { version: 2 })).values), [3]);
});

test("what is no array of numbers is refused with the reason", () => {
  assert.throws(() => decodeNpy(new ArrayBuffer(64)), /not an .npy file/);
  assert.throws(() => decodeNpy(npy("<c8", [1], Float32Array.of(1, 2))), /unsupported type/);
  assert.throws(() => decodeNpy(npy("<f4", [9], Float32Array.of(1, 2))), /cut off/);
});

const colors = (shape, numbers, type, encoding = "") =>
  Array.from(colorsOf({ shape, values: numbers, type }, encoding).values);

test("a grey picture has three equal channels, and alpha is left out", () => {
  assert.deepEqual(colors([1, 2], Float32Array.of(1, 5), "f4"), [1, 1, 1, 5, 5, 5]);
  assert.deepEqual(colors([1, 1, 2], Float32Array.of(3, 1), "f4"), [3, 3, 3]);
  assert.deepEqual(colors([1, 1, 4], Float32Array.of(1, 2, 3, 1), "f4"), [1, 2, 3]);
});

test("floats keep values above 1 and whole numbers are shares of the largest", () => {
  assert.deepEqual(colors([1, 1, 3], Float32Array.of(7, -1, 0.5), "f4"), [7, -1, 0.5]);
  assert.deepEqual(colors([1, 1], Uint8Array.of(255), "u1"), [1, 1, 1]);
  assert.deepEqual(colors([1, 1], Uint16Array.of(65535), "u2", "srgb"), [1, 1, 1]);
});

test("an array of another shape is not a picture", () => {
  assert.throws(() => colors([4], Float32Array.of(1, 2, 3, 4), "f4"), /not a picture/);
  assert.throws(() => colors([1, 1, 5], new Float32Array(5), "f4"), /not a picture/);
});
