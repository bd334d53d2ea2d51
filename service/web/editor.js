// A JSON editor with line numbers, colours, and problems beside their lines. A plain text area lies over the drawn text,
// so that the browser handles selection, undo, screen readers and touch.

import { h } from "./dom.js";
import { lineStarts, tokens } from "./json_text.js";

// Longer lines are drawn in one colour: a mesh on one line has too many tokens to colour.
const COLOURED = 2000;
// Shared by all lines without problems, so that they compare as equal.
const NONE = [];

function drawn(text, problems, number) {
  const line = h("div", {
    className: problems.length ? "line wrong" : "line",
    "data-number": String(number),
  });
  const culprits = problems.map((problem) => problem.column - 1);
  const parts = text.length > COLOURED ? [{ text, kind: "other", start: 0 }] : tokens(text);
  for (const { text: part, kind, start } of parts) {
    const culprit = culprits.some((column) => column >= start && column < start + part.length) && part.trim();
    if (kind === "other" && !culprit) line.append(part);
    else line.append(h("span", { className: culprit ? `${kind} culprit` : kind }, part));
  }
  if (problems.length) {
    const more = problems.length > 1 ? ` (and ${problems.length - 1} more)` : "";
    line.append(h("span", { className: "detail" }, problems[0].detail + more));
  }
  return line;
}

/**
 * Make an editor.
 *
 * @param {{label: string, describedBy?: string, readOnly?: boolean, onInput?: () => void}} options
 * @returns {object} `element`; `text`, to be read and set; `mark(problems)`, each with `line`, `column` and `detail`;
 *   `point(start, end)`, which shows and selects a piece of the text.
 */
export function makeEditor({ label, describedBy, readOnly = false, onInput = () => {} }) {
  const area = h("textarea", {
    className: "editor-area",
    "aria-label": label,
    "aria-describedby": describedBy,
    readOnly,
    spellcheck: false,
    autocapitalize: "off",
    autocomplete: "off",
    wrap: "off",
  });
  const lines = h("div", { className: "editor-lines", "aria-hidden": "true" });
  const element = h("div", { className: readOnly ? "editor readonly" : "editor" }, lines, area);
  let shown = [];
  let problems = new Map();

  function draw() {
    const texts = area.value.split("\n");
    const wanted = texts.map((text, i) => ({ text, problems: problems.get(i + 1) ?? NONE }));
    const same = (a, b) => a && b && a.text === b.text && a.problems === b.problems;
    const least = Math.min(shown.length, wanted.length);
    let head = 0;
    while (head < least && same(shown[head], wanted[head])) head++;
    let tail = 0;
    while (tail < least - head && same(shown[shown.length - 1 - tail], wanted[wanted.length - 1 - tail]))
      tail++;
    const old = Array.from(lines.children).slice(head, shown.length - tail);
    const fresh = wanted
      .slice(head, wanted.length - tail)
      .map((line, i) => drawn(line.text, line.problems, head + i + 1));
    const after = lines.children[shown.length - tail] ?? null;
    for (const line of fresh) lines.insertBefore(line, after);
    for (const line of old) line.remove();
    if (fresh.length !== old.length) renumber(head + fresh.length);
    shown = wanted;
    const digits = String(texts.length).length;
    element.style.setProperty("--digits", digits);
  }

  function renumber(from) {
    for (let i = from; i < lines.children.length; i++) lines.children[i].dataset.number = String(i + 1);
  }

  function mark(found) {
    const byLine = new Map();
    for (const problem of found) {
      if (problem.line) byLine.set(problem.line, [...(byLine.get(problem.line) ?? []), problem]);
    }
    // A line with the same problems keeps its list, and is not drawn again.
    for (const [line, list] of byLine) {
      const before = problems.get(line);
      if (before && JSON.stringify(before) === JSON.stringify(list)) byLine.set(line, before);
    }
    problems = byLine;
    area.setAttribute("aria-invalid", String(found.length > 0));
    draw();
  }

  function point(start, end, { focus = true } = {}) {
    area.setSelectionRange(start, end);
    if (focus) area.focus({ preventScroll: true });
    const starts = lineStarts(area.value);
    const first = starts.findLastIndex((offset) => offset <= start);
    const last = starts.findLastIndex((offset) => offset <= Math.max(start, end - 1));
    for (const line of lines.querySelectorAll(".pointed")) line.classList.remove("pointed");
    for (let i = first; i <= last; i++) lines.children[i]?.classList.add("pointed");
    reveal(lines.children[first], lines.children[last]);
  }

  function reveal(first, last) {
    if (!first) return;
    const height = element.clientHeight;
    const whole = last.offsetTop + last.offsetHeight - first.offsetTop;
    const above = Math.max(0, (height - Math.min(whole, height)) / 2);
    element.scrollTo({ top: first.offsetTop - above, left: 0 });
    element.scrollIntoView({ block: "nearest" });
  }

  function indent(event) {
    if (event.key !== "Enter" || event.ctrlKey || event.metaKey || event.isComposing || readOnly) return;
    const before = area.value.slice(0, area.selectionStart);
    const line = before.slice(before.lastIndexOf("\n") + 1);
    const space = /^\s*/.exec(line)[0] + (/[[{]\s*$/.test(line) ? "  " : "");
    event.preventDefault();
    // The only way to insert text that the browser can undo.
    document.execCommand("insertText", false, `\n${space}`);
  }

  area.addEventListener("input", () => {
    draw();
    onInput();
  });
  area.addEventListener("keydown", indent);
  draw();

  return {
    element,
    area,
    mark,
    point,
    get text() {
      return area.value;
    },
    set text(text) {
      area.value = text;
      draw();
      element.scrollTo({ top: 0, left: 0 });
    },
  };
}
