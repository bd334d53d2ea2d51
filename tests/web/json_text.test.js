import assert from "node:assert/strict";
import { test } from "node:test";

import { places, readable, tokenLength } from "../../service/web/json_text.js";

/** The text of a scene in one line that is as long as programs write them. @param {string} members */
const long = (members) =>
  `{"name": "a, \\"{b", "vertices": [${Array(900).fill("[0, 1.50, -2e-7]")}], ${members}}`;

test("a long line is formatted again and means the same", () => {
  const text = long('"seed": 7, "camera": {"up": [0, 1, 0]}, "none": [{}, [], null, true]');
  const formatted = readable(text);
  assert.deepEqual(JSON.parse(formatted), JSON.parse(text));
  assert.ok(formatted.split("\n").every((line) => line.length < 200));
});

for (const [kind, members] of [
  ["a field that stands twice", '"seed": 7, "seed": 8'],
  ["a number that is too large", '"size": [1, -1e400]'],
  ["a mistake", '"seed": 7,'],
])
  test(`a long line with ${kind} stays as it is`, () => {
    const text = long(members);
    assert.equal(readable(text), text);
  });

test("a string of megabytes is one token", () => {
  const string = JSON.stringify(`"${"x".repeat(12e6)}\\`);
  const text = `{"name": ${string}, "seed": 7}`;
  assert.equal(places(text, ["/seed"]).get("/seed")?.value, text.length - 2);
  assert.equal(tokenLength(text, 9), string.length);
});
