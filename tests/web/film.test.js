import assert from "node:assert/strict";
import { test } from "node:test";

import { develop } from "../../service/web/views/picture/darkroom.js";
import { Film } from "../../service/web/views/picture/film.js";
import { plainLook } from "../../service/web/views/picture/look.js";
import { Encoder } from "../../service/web/views/picture/transfer.js";
import { NO_NUMBER, TOO_BRIGHT, TOO_DARK, marksOf } from "../../service/web/views/picture/zebra.js";

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

test("every clipped pixel has a mark, at the exposure of the display", () => {
  const film = new Film(6, 1);
  film.fill(grey(1, 2, -1, NaN, Infinity, 0.6));
  assert.deepEqual(Array.from(marksOf(film, 0, 1).words), [
    0,
    TOO_BRIGHT,
    TOO_DARK,
    NO_NUMBER,
    TOO_BRIGHT,
    0,
  ]);
  assert.equal(marksOf(film, 1, 1).words[5], TOO_BRIGHT);
  assert.deepEqual(Array.from(marksOf(new Film(1, 1), 0, 1).words), [0]);
});

test("one clipped pixel marks the block that shares a pixel of the display with it", () => {
  const film = new Film(5, 3);
  film.fill(grey(...Array.from({ length: 15 }, (_, i) => (i === 14 ? 2 : 0))));
  assert.deepEqual(Array.from(marksOf(film, 0, 2).words), [0, 0, 0, 0, 0, TOO_BRIGHT]);
});
