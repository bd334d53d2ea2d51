// Differences of two scenes: shapes are the same by name, wherever they stand.

import assert from "node:assert/strict";
import { test } from "node:test";

import { differencesOf } from "../../service/web/views/compare/scenes.js";

const [floor, ball, box] = ["floor", "ball", "box"].map((name) => ({ name, size: 1 }));

/** @param {object[]} a @param {object[]} b */
const places = (a, b) => differencesOf({ shapes: a }, { shapes: b }).map(({ place }) => place);

test("a shape inserted before others is the one difference", () => {
  assert.deepEqual(places([floor, ball], [box, floor, ball]), ["/shapes/box"]);
  assert.deepEqual(places([floor, ball], [box, floor, { ...ball, size: 2 }]), [
    "/shapes/ball/size",
    "/shapes/box",
  ]);
});

test("shapes without a name of their own are compared by index", () => {
  assert.deepEqual(places([{ size: 1 }, ball, ball], [{ size: 2 }, ball, { ...ball, size: 2 }]), [
    "/shapes/0/size",
    "/shapes/2/size",
  ]);
});

test("another order is a difference", () => {
  assert.deepEqual(differencesOf([floor, ball], [ball, floor]), [
    { place: "", a: ["floor", "ball"], b: ["ball", "floor"] },
  ]);
  assert.deepEqual(differencesOf([{ a: 1, b: 2 }], [{ b: 2, a: 1 }]), []);
});
