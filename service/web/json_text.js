// JSON as text: its tokens for colours, where its pointers stand, and a form in which people like to read it.

const TOKEN =
  /("(?:[^"\\]|\\.)*"?)(\s*:)?|(-?\d[\d.eE+-]*)|(true|false|null)|([{}[\],:])|\s+|[^\s"{}[\],:]+/y;

/**
 * The tokens of one line; no token of JSON crosses lines.
 *
 * @returns {{text: string, kind: "key" | "string" | "number" | "word" | "mark" | "other", start: number}[]}
 */
export function tokens(line) {
  const found = [];
  TOKEN.lastIndex = 0;
  for (let match; TOKEN.lastIndex < line.length && (match = TOKEN.exec(line));) {
    const [text, string, colon, number, word, mark] = match;
    if (string !== undefined) {
      found.push({ text: string, kind: colon === undefined ? "string" : "key", start: match.index });
      if (colon !== undefined) found.push({ text: colon, kind: "mark", start: match.index + string.length });
    } else {
      const kind =
        number !== undefined ? "number" : word !== undefined ? "word" : mark !== undefined ? "mark" : "other";
      found.push({ text, kind, start: match.index });
    }
  }
  return found;
}

/**
 * Where the values that JSON Pointers name stand in a text.
 *
 * @param {string} text - JSON.
 * @param {Iterable<string>} pointers - RFC 6901, into the document.
 * @returns {Map<string, {line: number, column: number, start: number, value: number, end: number}>} Lines and columns
 *   from 1, at the key where the value has one; offsets of the whole, its key included, and of the value alone. What the
 *   text does not have is missing, and so is everything where the text is no JSON.
 */
export function places(text, pointers) {
  const wanted = new Set(pointers);
  const spans = new Map();
  try {
    JSON.parse(text);
  } catch {
    return spans;
  }
  walk(text, wanted, spans);
  const starts = lineStarts(text);
  for (const span of spans.values()) {
    span.line = lineOf(starts, span.start);
    span.column = span.start - starts[span.line - 1] + 1;
  }
  return spans;
}

/** Offsets at which the lines of a text begin. */
export function lineStarts(text) {
  const starts = [0];
  for (let at = text.indexOf("\n"); at >= 0; at = text.indexOf("\n", at + 1)) starts.push(at + 1);
  return starts;
}

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

const VALUE = /"(?:[^"\\]|\\.)*"|[{}[\],:]|[^\s"{}[\],:]+/g;

function walk(text, wanted, spans) {
  // A frame for each open bracket: its pointer, the index or key of its next value, and where that key began.
  const frames = [];
  const top = () => frames[frames.length - 1];
  const pointer = () => {
    const frame = top();
    return frame ? `${frame.pointer}/${String(frame.name).replaceAll("~", "~0").replaceAll("/", "~1")}` : "";
  };
  const ended = (at, start, value, end) => wanted.has(at) && spans.set(at, { start, value, end });
  const next = () => {
    const frame = top();
    if (frame && !frame.keyed) frame.name++;
    if (frame) frame.at = null;
  };
  for (const { 0: token, index } of text.matchAll(VALUE)) {
    const frame = top();
    if (token === "{" || token === "[") {
      const keyed = token === "{";
      frames.push({
        pointer: pointer(),
        keyed,
        name: keyed ? null : 0,
        at: null,
        start: frame?.at ?? index,
        value: index,
      });
    } else if (token === "}" || token === "]") {
      const closed = frames.pop();
      ended(closed.pointer, closed.start, closed.value, index + 1);
      next();
    } else if (token[0] === '"' && frame?.keyed && frame.at === null) {
      frame.name = JSON.parse(token);
      frame.at = index;
    } else if (token !== "," && token !== ":") {
      ended(pointer(), frame?.at ?? index, index, index + token.length);
      next();
    }
  }
}

// As many characters as an array or a small object may take to stay on one line.
const WIDTH = 110;

/** A value as text, as the scenes of the gallery are written: what fits on a line stands on one. */
export function written(value, indent = "") {
  const flat = JSON.stringify(value, null, 1)
    ?.replace(/\n\s*/g, " ")
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

// A line so long was written by a program, and is laid out anew for people.
const LONG_LINE = 2000;

/** A text as people can read it: as it is, unless it has lines without an end. */
export function readable(text) {
  if (!text.split("\n").some((line) => line.length > LONG_LINE)) return text;
  try {
    return written(JSON.parse(text));
  } catch {
    return text;
  }
}
