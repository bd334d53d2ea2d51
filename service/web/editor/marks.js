// Lines of the editor that have problems, with the messages under them, and lines that something points at.

import { h } from "../dom.js";
import { tokenLength } from "../json_text.js";
import {
  Decoration,
  EditorSelection,
  EditorView,
  GutterMarker,
  RangeSet,
  StateEffect,
  StateField,
  WidgetType,
  gutterLineClass,
  gutterWidgetClass,
} from "../vendor/codemirror/codemirror.js";

/** @import { ChangeDesc, DecorationSet, Line, StateEffectType, Text } from "../vendor/codemirror/codemirror.js" */
/** @typedef {{from: number, to: number}} Range */
/** @typedef {Range & {detail: string}} Problem */

/** Replaces the problems, which are in their order in the text. @type {StateEffectType<Problem[]>} */
export const problemLines = StateEffect.define();
/** Replaces the lines that are pointed at. @type {StateEffectType<Range[]>} */
export const pointedLines = StateEffect.define();

const CULPRIT = Decoration.mark({ class: "culprit" });

class Details extends WidgetType {
  /** @param {string[]} texts */
  constructor(texts) {
    super();
    this.texts = texts;
  }
  /** @param {Details} other */
  eq(other) {
    return this.texts.length === other.texts.length && this.texts.every((text, i) => text === other.texts[i]);
  }
  toDOM() {
    const texts = this.texts.map((text) => h("p", { className: "detail" }, text));
    return h("div", { className: "details" }, texts);
  }
}

class NumberClass extends GutterMarker {
  /** @param {string} name */
  constructor(name) {
    super();
    this.elementClass = name;
  }
}
const BESIDE = new NumberClass("beside");
const NUMBERS = { wrong: new NumberClass("wrong"), pointed: new NumberClass("pointed") };

/** @param {keyof typeof NUMBERS} kind @param {Line} line */
function lineMark(kind, line) {
  const attributes = { class: `line ${kind}`, "data-number": String(line.number) };
  return Decoration.line({ attributes, kind }).range(line.from);
}

/**
 * Problems that have a line, in the order of the text.
 *
 * @param {Text} doc
 * @param {ProblemEntry[]} problems
 * @returns {Problem[]}
 */
export function located(doc, problems) {
  const found = problems.flatMap(({ line, column, detail }) => {
    if (!line || line > doc.lines) return [];
    const { from, to, text } = doc.line(line);
    const start = Math.min(from + (column ?? 1) - 1, to);
    return [{ from: start, to: start + tokenLength(text, start - from), detail }];
  });
  return found.sort((a, b) => a.from - b.from);
}

/** @param {Text} doc @param {Problem[]} problems */
function problemMarks(doc, problems) {
  /** @type {Map<number, Problem[]>} */
  const byLine = new Map();
  for (const problem of problems) {
    const { number } = doc.lineAt(problem.from);
    byLine.set(number, [...(byLine.get(number) ?? []), problem]);
  }
  const found = Array.from(byLine, ([number, list]) => marksOfLine(doc.line(number), list));
  return Decoration.set(found.flat(), true);
}

/** @param {Line} line @param {Problem[]} problems */
function marksOfLine(line, problems) {
  const widget = new Details(problems.map(({ detail }) => detail));
  const tokens = problems.filter(({ from, to }) => from < to);
  return [
    lineMark("wrong", line),
    ...tokens.map(({ from, to }) => CULPRIT.range(from, to)),
    Decoration.widget({ widget, block: true, side: 1 }).range(line.to),
  ];
}

/** @param {Text} doc @param {Range[]} ranges */
function pointedMarks(doc, ranges) {
  const numbers = ranges.flatMap(({ from, to }) => {
    const first = doc.lineAt(from).number;
    const last = doc.lineAt(Math.max(from, to - 1)).number;
    return Array.from({ length: last - first + 1 }, (_, i) => first + i);
  });
  return Decoration.set(numbers.map((number) => lineMark("pointed", doc.line(number))));
}

/**
 * A range after an edit, unless that replaced all of it.
 *
 * @template {Range} Kind
 * @param {Kind} range
 * @param {ChangeDesc} changes
 * @returns {Kind[]}
 */
function moved(range, changes) {
  const from = changes.mapPos(range.from, 1);
  const to = Math.max(from, changes.mapPos(range.to, -1));
  return from === to && range.from < range.to ? [] : [{ ...range, from, to }];
}

/**
 * Decorations of ranges that an effect replaces, and that move with the text when it is edited.
 *
 * @template {Range} Kind
 * @param {StateEffectType<Kind[]>} effect
 * @param {(doc: Text, ranges: Kind[]) => DecorationSet} made
 */
function decorations(effect, made) {
  return StateField.define({
    create: () => ({ ranges: /** @type {Kind[]} */ ([]), set: Decoration.none }),
    update(before, { changes, docChanged, effects, state }) {
      const sent = effects.find((one) => one.is(effect));
      if (!sent && !docChanged) return before;
      const ranges = sent?.is(effect) ? sent.value : before.ranges.flatMap((range) => moved(range, changes));
      return { ranges, set: made(state.doc, ranges) };
    },
    provide: (field) => [
      EditorView.decorations.from(field, ({ set }) => set),
      gutterLineClass.compute([field], (state) => numbers(state.field(field).set)),
    ],
  });
}

/** @param {DecorationSet} found */
function numbers(found) {
  const classes = [];
  for (const at = found.iter(); at.value; at.next()) {
    const name = NUMBERS[/** @type {keyof typeof NUMBERS} */ (at.value.spec.kind)];
    if (name) classes.push(name.range(at.from));
  }
  return RangeSet.of(classes);
}

const problems = decorations(problemLines, problemMarks);
const pointed = decorations(pointedLines, pointedMarks);

export const marks = [
  problems,
  pointed,
  gutterWidgetClass.of((view, widget) => (widget instanceof Details ? BESIDE : null)),
  EditorView.contentAttributes.compute([problems], (state) => ({
    "aria-invalid": String(state.field(problems).ranges.length > 0),
  })),
];

/** Go to the next problem, or to the first after the last one. @param {EditorView} view */
export const nextProblem = (view) => goTo(view, (at, all) => all.find(({ from }) => from > at) ?? all[0]);

/** Go to the previous problem, or to the last before the first one. @param {EditorView} view */
export const previousProblem = (view) =>
  goTo(view, (at, all) => all.findLast(({ to }) => to < at) ?? all.at(-1));

/** @param {EditorView} view @param {(at: number, all: Range[]) => Range | undefined} chosen */
function goTo(view, chosen) {
  const { doc, selection } = view.state;
  const found = chosen(selection.main.from, view.state.field(problems).ranges);
  if (!found) return false;
  const { from, to } = found;
  view.dispatch({ selection: { anchor: from, head: to }, effects: inSight(doc, found, "nearest") });
  return true;
}

/**
 * Scrolls to a range, sideways no farther than its first line needs.
 *
 * @param {Text} doc
 * @param {Range} range
 * @param {"center" | "nearest"} y
 */
export function inSight(doc, { from, to }, y) {
  // From its end to its start, which is what remains in sight of a range that is wider than the editor.
  const shown = EditorSelection.range(Math.min(to, doc.lineAt(from).to), from);
  return EditorView.scrollIntoView(shown, { y, x: "nearest", xMargin: 64 });
}
