import assert from "node:assert/strict";
import { test } from "node:test";

import { layerOf, metricsOf } from "../../service/web/views/compare/differences.js";
import { Film } from "../../service/web/views/picture/film.js";
import {
  PER_STOP,
  STOPS,
  countClipped,
  exposureFor,
  histogramOf,
} from "../../service/web/views/picture/histogram.js";
import { minus, short } from "../../service/web/views/picture/numbers.js";
import { statisticsOf } from "../../service/web/views/picture/statistics.js";

function film(width, height, values) {
  const made = new Film(width, height);
  made.fill(values);
  return made;
}

const grey = (...values) => values.flatMap((value) => [value, value, value]);

/** The sum of counts, and the bin of a single value. */
const binOf = (value) => histogramOf(film(1, 1, grey(value))).counts[0].indexOf(1);

test("a value is counted in the bin of its stop", () => {
  assert.equal(binOf(1.01), -STOPS.low * PER_STOP);
  assert.equal(binOf(0.99), -STOPS.low * PER_STOP - 1);
  assert.equal(binOf(2 ** 0.26), -STOPS.low * PER_STOP + 1);
  assert.equal(binOf(1e-30), 0);
  assert.equal(binOf(1e30), (STOPS.high - STOPS.low) * PER_STOP - 1);
});

test("dark, infinite and unknown values are counted apart", () => {
  const part = new Film(2, 1);
  part.take({ x0: 0, y0: 0, x1: 1, y1: 1, stride: 1, columns: 1, pixels: Float32Array.of(0, -1, NaN) });
  const { dark, infinite, total, counts } = histogramOf(part);
  assert.deepEqual([dark, infinite, total], [2, 1, 3]);
  assert.ok(counts.every((bins) => bins.every((count) => count === 0)));
});

test("exactly the values above display white are clipped", () => {
  const picture = film(4, 1, grey(0.5, 0.500001, 2, -9));
  assert.equal(countClipped(picture, 1), 6);
  assert.equal(countClipped(picture, 0), 3);
  assert.equal(countClipped(picture, -1), 0);
});

test("the exposure that fits leaves one pixel of a hundred above white", () => {
  const values = Array.from({ length: 1000 }, (_, i) => (i < 5 ? 1000 : 4));
  assert.equal(exposureFor(film(100, 10, grey(...values))), -2);
  assert.equal(exposureFor(film(1, 1, grey(0.3))), 1.5);
  assert.equal(exposureFor(film(1, 1, grey(0))), null);
});

test("statistics are of the rectangle alone, and leave out what is not finite", () => {
  const values = Float32Array.of(9, 1, 2, 9, 3, NaN, 9, 9, 9);
  const [found] = statisticsOf(values, 1, 3, { x0: 1, y0: 0, x1: 3, y1: 2 });
  assert.deepEqual(found, { mean: 2, least: 1, greatest: 3, variance: 2 / 3, count: 3 });
});

test("the variance of large values does not cancel", () => {
  const values = Float64Array.from({ length: 4 }, (_, i) => 1e9 + (i % 2));
  assert.equal(statisticsOf(values, 1, 4, { x0: 0, y0: 0, x1: 4, y1: 1 })[0].variance, 0.25);
});

test("two equal infinities are 0 apart in the readout", () => {
  assert.deepEqual([minus(Infinity, Infinity), minus(-Infinity, -Infinity), minus(3, 1)].map(short), [
    "0",
    "0",
    "2",
  ]);
  assert.deepEqual([minus(-Infinity, Infinity), minus(NaN, NaN)].map(short), ["−∞", "NaN"]);
});

test("the difference is the largest of the channels, and equal infinities are none", () => {
  const a = film(2, 1, [1, 5, 0, Infinity, 1, 1]);
  const b = film(2, 1, [1.5, 2, 0, Infinity, 1, 1]);
  assert.deepEqual(Array.from(layerOf("difference", a, b).values), [3, 0]);
  assert.ok(Number.isNaN(layerOf("difference", film(1, 1, grey(NaN)), film(1, 1, grey(0))).values[0]));
});

test("the mean square of relative differences of grey pictures is the relative error", () => {
  const [a, b] = [film(2, 1, grey(0.5, 0.1)), film(2, 1, grey(0.4, 0))];
  const { values } = layerOf("relative difference", a, b);
  const mean = values.reduce((sum, value) => sum + value * value, 0) / 2;
  const { relmse } = metricsOf(a, b, a.whole);
  assert.ok(Math.abs(mean - relmse) < 1e-7 * relmse);
});

test("metrics are of clipped values", () => {
  const [a, b] = [film(2, 1, grey(7, 0.5)), film(2, 1, grey(1, 0.25))];
  const found = metricsOf(a, b, a.whole);
  assert.equal(found.rmse, Math.sqrt(0.25 ** 2 / 2));
  assert.deepEqual([found.max_abs, found.frac_over], [0.25, 0.5]);
  assert.deepEqual(found.worst, { x: 1, y: 0 });
  assert.deepEqual(metricsOf(b, a, { x0: 1, y0: 0, x1: 2, y1: 1 }).worst, { x: 1, y: 0 });
  const { psnr, worst } = metricsOf(a, a, a.whole);
  assert.deepEqual([psnr, worst], [null, null]);
  assert.equal(metricsOf(a, b, { x0: 0, y0: 0, x1: 1, y1: 1 }).rmse, 0);
});

test("the heat map is black where nothing differs and white from a displayed difference of a quarter on", () => {
  const layer = layerOf("displayed difference", film(2, 1, grey(3, 1)), film(2, 1, grey(2, 0)));
  assert.deepEqual(
    [0, 1].map((x) => layer.codes(x, 0)),
    [
      [0, 0, 0],
      [255, 255, 255],
    ],
  );
});
