import assert from "node:assert/strict";
import { test } from "node:test";

import { Film } from "../../service/web/views/picture/film.js";
import { NO_NUMBER, TOO_BRIGHT, TOO_DARK, plainLook } from "../../service/web/views/picture/look.js";
import { develop } from "../../service/web/views/picture/software.js";
import { Encoder } from "../../service/web/views/picture/transfer.js";

const tile = (x0, y0, x1, y1, stride, pixels) => ({
  x0,
  y0,
  x1,
  y1,
  stride,
  columns: Math.ceil((x1 - x0) / stride),
  pixels: Float32Array.from(pixels),
});

const grey = (...values) => values.flatMap((value) => [value, value, value]);

function words(film, part = {}) {
  const packed = new Uint32Array(film.width * film.height);
  develop(film, { ...plainLook(), encoder: new Encoder(0, "linear"), ...part }, film.whole, packed);
  return Array.from(packed);
}

test("a pixel is not known before its tile has come, and is transparent", () => {
  const film = new Film(2, 1);
  assert.ok(film.empty);
  film.take(tile(1, 0, 2, 1, 1, grey(1)));
  assert.equal(film.at(0, 0), null);
  assert.deepEqual(film.at(1, 0), [1, 1, 1]);
  assert.deepEqual(words(film), [0, 0xffffffff]);
});

test("a value of a preview covers its block up to the edge of the picture", () => {
  const film = new Film(3, 3);
  film.take(tile(0, 0, 3, 3, 2, grey(1, 2, 3, 4)));
  const seen = [0, 1, 2].map((y) => [0, 1, 2].map((x) => film.at(x, y)[0]));
  assert.deepEqual(seen, [
    [1, 1, 2],
    [1, 1, 2],
    [3, 3, 4],
  ]);
});

test("a pixel that is no number is known, and black", () => {
  const film = new Film(1, 1);
  film.fill(grey(NaN));
  assert.deepEqual(film.at(0, 0), [NaN, NaN, NaN]);
  assert.deepEqual(words(film), [0xff000000]);
});

test("the luminance follows tiles that come later", () => {
  const film = new Film(2, 1);
  film.fill([1, 0, 0, 0, 0, 1]);
  assert.deepEqual(Array.from(film.luminance), [0.2126, 0.0722].map(Math.fround));
  film.take(tile(0, 0, 1, 1, 1, [0, 1, 0]));
  assert.deepEqual(Array.from(film.luminance), [0.7152, 0.0722].map(Math.fround));
});

test("one channel is shown as grey", () => {
  const film = new Film(1, 1);
  film.fill([0, 0.2, 1]);
  const shown = ["red", "green", "blue"].map((channel) => words(film, { channel })[0]);
  assert.deepEqual(shown, [0xff000000, 0xff333333, 0xffffffff]);
});

test("clipped pixels have stripes, and those that are no numbers are marked whole", () => {
  const film = new Film(8, 1);
  film.fill(grey(1, 2, 2, -1, -1, NaN, Infinity, 0.5));
  const marked = words(film, { stripe: 1 });
  assert.deepEqual(marked.slice(0, 3), [0xffffffff, TOO_BRIGHT, 0xffffffff]);
  assert.deepEqual([marked[3], marked[4]], [TOO_DARK, 0xff000000]);
  assert.deepEqual([marked[5], marked[6], marked[7]], [NO_NUMBER, 0xffffffff, 0xff808080]);
});

test("what is clipped depends on the exposure", () => {
  const film = new Film(2, 1);
  film.fill(grey(0.4, 0.6));
  const marked = words(film, { stripe: 1, encoder: new Encoder(1, "linear") });
  assert.deepEqual(marked, [0xffcccccc, TOO_BRIGHT]);
});
