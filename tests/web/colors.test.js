import assert from "node:assert/strict";
import { test } from "node:test";

import { COLORMAPS, GREY, named, paletteOf, unpack } from "../../service/web/views/picture/colormaps.js";
import { Layer } from "../../service/web/views/picture/layers.js";
import { isScale, leastPositive, middleOf, scaleOf, steps } from "../../service/web/views/picture/scales.js";

const luminance = (word) =>
  unpack(word).reduce((sum, code, i) => sum + [0.2126, 0.7152, 0.0722][i] * code, 0);

for (const name of COLORMAPS)
  test(`${name} grows brighter from its first colour to its last`, () => {
    const levels = Array.from(paletteOf(name), luminance);
    assert.equal(levels.length, 256);
    assert.ok(levels.every((level, i) => i === 0 || level >= levels[i - 1] - 1));
    assert.ok(levels[255] > levels[0] + 150);
  });

test("neighbouring numbers have different colours, and none is black", () => {
  const colors = Array.from({ length: 50 }, (_, i) => named(i));
  assert.equal(new Set(colors).size, 50);
  assert.deepEqual(unpack(named(-1)), [0, 0, 0]);
});

test("a scale goes from the least to the greatest finite value", () => {
  const scale = scaleOf([3, NaN, -1, Infinity, 7]);
  assert.deepEqual([scale.low, scale.high], [-1, 7]);
  assert.deepEqual([scaleOf([NaN]).low, scaleOf([]).high], [0, 0]);
});

test("equal differences or equal ratios are equal steps", () => {
  const scale = { low: 1, high: 100, log: false, colors: "grey" };
  assert.deepEqual([1, 50.5, 100, 200, -5].map(steps(scale, 101)), [0, 50, 100, 100, 0]);
  assert.deepEqual([1, 10, 100, 0].map(steps({ ...scale, log: true }, 101)), [0, 50, 100, 0]);
  assert.deepEqual([middleOf(scale), middleOf({ ...scale, log: true })], [50.5, 10]);
});

test("all of a constant layer has the first colour", () => {
  assert.deepEqual([5, 6].map(steps({ low: 5, high: 5, log: false, colors: "grey" }, 256)), [0, 0]);
});

test("a scale without a range, or a logarithmic one from zero, makes no sense", () => {
  assert.ok(!isScale({ low: 1, high: 1, log: false, colors: "grey" }));
  assert.ok(!isScale({ low: 0, high: 1, log: true, colors: "grey" }));
  assert.ok(!isScale({ low: NaN, high: 1, log: false, colors: "grey" }));
  assert.ok(isScale({ low: 0, high: 1, log: false, colors: "grey" }));
  assert.equal(leastPositive([0, -3, 2, 0.5, NaN]), 0.5);
});

test("infinite and missing values of a layer are grey", () => {
  const layer = new Layer("depth", [1, 4], Float32Array.of(1, 2, Infinity, NaN));
  assert.deepEqual(
    [2, 3].map((x) => layer.codes(x, 0)),
    [unpack(GREY), unpack(GREY)],
  );
  assert.deepEqual(
    [0, 1].map((x) => layer.codes(x, 0)),
    [paletteOf("viridis")[0], paletteOf("viridis")[255]].map(unpack),
  );
});

test("the error of a pixel is that of its worst channel", () => {
  const layer = new Layer("error", [1, 2, 3], Float32Array.of(0, 0.5, 0.1, 1, 0, 0));
  assert.equal(layer.kind, "scale");
  assert.deepEqual([layer.scale.low, layer.scale.high], [0.5, 1]);
});

test("directions are colours from -1 to 1, and names have their own", () => {
  const normal = new Layer("normal", [1, 1, 3], Float32Array.of(0, 1, -1));
  assert.deepEqual(normal.codes(0, 0), [128, 255, 0]);
  const shape = new Layer("shape", [1, 3], Int32Array.of(0, 1, -1));
  assert.deepEqual(
    [0, 1, 2].map((x) => shape.codes(x, 0)),
    [0, 1, -1].map((one) => unpack(named(one))),
  );
});
