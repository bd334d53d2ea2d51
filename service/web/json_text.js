// JSON as text: tokens, the places of JSON Pointers, and readable formatting.

/** A name as a part of a JSON Pointer. @param {string} name */
export const pointerPart = (name) => name.replaceAll("~", "~0").replaceAll("/", "~1");

/** The names and numbers in a JSON Pointer. @param {string} pointer */
export const pointerParts = (pointer) =>
  pointer
    .split("/")
    .slice(1)
    .map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));

/** The length of the token at a place of a text, 0 where none is; a string may lack its end. @param {string} text @param {number} start */
export function tokenLength(text, start) {
  const end = text.indexOf("\n", start);
  const line = text.slice(start, end < 0 ? undefined : end);
  return line.startsWith('"') ? stringEnd(line, 0) : (/^[^\s,\]}]+/.exec(line)?.[0].length ?? 0);
}

/** Where a string ends. Expressions run out of stack in strings of some megabytes. @param {string} text @param {number} start */
function stringEnd(text, start) {
  for (let quote = start; (quote = text.indexOf('"', quote + 1)) >= 0;) {
    let first = quote;
    while (text[first - 1] === "\\") first--;
    if ((quote - first) % 2 === 0) return quote + 1;
  }
  return text.length;
}

/**
 * @typedef {{start: number, value: number, end: number}} Span
 * @typedef {Span & {line: number, column: number}} Place
 */

/**
 * Find the places in a text that JSON Pointers refer to.
 *
 * @param {string} text - JSON.
 * @param {Iterable<string>} pointers - RFC 6901, into the document.
 * @returns {Map<string, Place>} Lines and columns
 *   from 1, at the key where the value has one; offsets with the key, and of the value alone. Pointers that the text
 *   lacks are missing, and so are all of them where the text is not JSON.
 */
export function places(text, pointers) {
  try {
    JSON.parse(text);
  } catch {
    return new Map();
  }
  const starts = lineStarts(text);
  return new Map(
    Array.from(walk(text, new Set(pointers)), ([pointer, span]) => {
      const line = lineOf(starts, span.start);
      return [pointer, { ...span, line, column: span.start - starts[line - 1] + 1 }];
    }),
  );
}

/** Offsets at which the lines of a text begin. @param {string} text */
export function lineStarts(text) {
  const starts = [0];
  for (let at = text.indexOf("\n"); at >= 0; at = text.indexOf("\n", at + 1)) starts.push(at + 1);
  return starts;
}

/** @param {number[]} starts @param {number} offset */
function lineOf(starts, offset) {
  let low = 0;
  let high = starts.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (starts[middle] <= offset) low = middle;
    else high = middle;
  }
  return low + 1;
}

/** The tokens of a text, and where they begin. @param {string} text - JSON. @returns {Generator<[string, number]>} */
function* tokens(text) {
  const next = /["{}[\],:]|[^\s"{}[\],:]+/g;
  for (let found; (found = next.exec(text));) {
    if (found[0] === '"') next.lastIndex = stringEnd(text, found.index);
    yield [text.slice(found.index, next.lastIndex), found.index];
  }
}

/**
 * An open bracket: its pointer, the index or key of its next value, and where that key began.
 *
 * @typedef {{pointer: string, keyed: boolean, name: string | number, at: number | null, start: number, value: number}} Frame
 */

/** @param {string} text - JSON. @param {Set<string>} wanted - Pointers. @returns {Map<string, Span>} */
function walk(text, wanted) {
  const spans = new Map();
  /** @type {Frame[]} */
  const frames = [];
  const top = () => frames.at(-1);
  const pointer = () => {
    const frame = top();
    return frame ? `${frame.pointer}/${pointerPart(String(frame.name))}` : "";
  };
  const ended = (/** @type {string} */ at, /** @type {Span} */ span) => wanted.has(at) && spans.set(at, span);
  const next = () => {
    const frame = top();
    if (!frame) return;
    if (typeof frame.name === "number") frame.name++;
    frame.at = null;
  };
  for (const [token, index] of tokens(text)) {
    const frame = top();
    if (token === "{" || token === "[") {
      const keyed = token === "{";
      frames.push({
        pointer: pointer(),
        keyed,
        name: keyed ? "" : 0,
        at: null,
        start: frame?.at ?? index,
        value: index,
      });
    } else if (token === "}" || token === "]") {
      const { pointer, start, value } = /** @type {Frame} */ (frames.pop());
      ended(pointer, { start, value, end: index + 1 });
      next();
    } else if (token[0] === '"' && frame?.keyed && frame.at === null) {
      frame.name = JSON.parse(token);
      frame.at = index;
    } else if (token !== "," && token !== ":") {
      ended(pointer(), { start: frame?.at ?? index, value: index, end: index + token.length });
      next();
    }
  }
  return spans;
}

// Arrays and objects up to this many characters stay on one line.
export const WIDTH = 110;

/**
 * Format a value like the scenes of the gallery: what fits on one line stays on one.
 *
 * @param {unknown} value - Of JSON.
 * @returns {string}
 */
export function written(value, indent = "") {
  const flat = JSON.stringify(value, null, 1)
    .replace(/\n\s*/g, " ")
    .replace(/([[{]) | ([\]}])/g, "$1$2");
  if (value === null || typeof value !== "object" || (indent && indent.length + flat.length <= WIDTH))
    return flat;
  const inner = `${indent}  `;
  const array = Array.isArray(value);
  const parts = Object.entries(value).map(
    ([key, part]) => inner + (array ? "" : `${JSON.stringify(key)}: `) + written(part, inner),
  );
  return parts.length ? `${array ? "[" : "{"}\n${parts.join(",\n")}\n${indent}${array ? "]" : "}"}` : flat;
}

// Longer lines were written by a program, and are formatted again.
const LONG_LINE = 2000;

/**
 * Format a text again if it has very long lines; otherwise return it as it is. One that would lose something stays as
 * well, such as a field that stands twice or a number that is too large: the service says what is wrong with it.
 *
 * @param {string} text
 * @param {number} [longest] - Characters of a line that people write.
 */
export function readable(text, longest = LONG_LINE) {
  if (!text.split("\n").some((line) => line.length > longest)) return text;
  try {
    const formatted = written(JSON.parse(text, refuseInfinite));
    return countTokens(formatted) === countTokens(text) ? formatted : text;
  } catch {
    return text;
  }
}

/** @param {string} _name @param {unknown} value */
function refuseInfinite(_name, value) {
  if (value === Infinity || value === -Infinity) throw new RangeError("JSON has no infinity.");
  return value;
}

/** @param {string} text - JSON. */
const countTokens = (text) => [...tokens(text)].length;
