// Lines of the editor that have problems, with the messages under them, and lines that something points at.

import { h } from "../dom.js";
import { tokenLength } from "../json_text.js";
import {
  Decoration,
  EditorView,
  GutterMarker,
  RangeSet,
  StateEffect,
  StateField,
  WidgetType,
  gutterLineClass,
  gutterWidgetClass,
} from "../vendor/codemirror/codemirror.js";

/** @import { DecorationSet, Line, StateEffectType, Text } from "../vendor/codemirror/codemirror.js" */
/** @typedef {{from: number, to: number}} Range */

/** Replaces the problems. @type {StateEffectType<ProblemEntry[]>} */
export const problemLines = StateEffect.define();
/** Replaces the lines that are pointed at. @type {StateEffectType<Range>} */
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

/** @param {Text} doc @param {ProblemEntry[]} problems */
function problemMarks(doc, problems) {
  /** @type {Map<number, ProblemEntry[]>} */
  const byLine = new Map();
  for (const problem of problems) {
    const { line } = problem;
    if (line && line <= doc.lines) byLine.set(line, [...(byLine.get(line) ?? []), problem]);
  }
  const found = Array.from(byLine, ([number, list]) => marksOfLine(doc.line(number), list));
  return Decoration.set(found.flat(), true);
}

/** @param {Line} line @param {ProblemEntry[]} problems */
function marksOfLine(line, problems) {
  const widget = new Details(problems.map(({ detail }) => detail));
  return [
    lineMark("wrong", line),
    ...problems.flatMap(({ column }) => culprit(line, (column ?? 1) - 1)),
    Decoration.widget({ widget, block: true, side: 1 }).range(line.to),
  ];
}

/** @param {Line} line @param {number} start */
function culprit(line, start) {
  const length = tokenLength(line.text, start);
  return length ? [CULPRIT.range(line.from + start, line.from + start + length)] : [];
}

/** @param {Text} doc @param {Range} range */
function pointedMarks(doc, { from, to }) {
  const first = doc.lineAt(from).number;
  const last = doc.lineAt(Math.max(from, to - 1)).number;
  const numbers = Array.from({ length: last - first + 1 }, (_, i) => first + i);
  return Decoration.set(numbers.map((number) => lineMark("pointed", doc.line(number))));
}

/**
 * Decorations that an effect replaces, and that move with the text when it is edited.
 *
 * @template Value
 * @param {StateEffectType<Value>} effect
 * @param {(doc: Text, value: Value) => DecorationSet} made
 */
function decorations(effect, made) {
  return StateField.define({
    create: () => Decoration.none,
    update(found, { changes, effects, state }) {
      const sent = effects.find((one) => one.is(effect));
      return sent?.is(effect) ? made(state.doc, sent.value) : found.map(changes);
    },
    provide: (field) => [
      EditorView.decorations.from(field),
      gutterLineClass.compute([field], (state) => numbers(state.field(field))),
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
    "aria-invalid": String(state.field(problems).size > 0),
  })),
];

/** Go to the next problem, or to the first after the last one. @param {EditorView} view */
export const nextProblem = (view) => goTo(view, (at, all) => all.find(({ from }) => from > at) ?? all[0]);

/** Go to the previous problem, or to the last before the first one. @param {EditorView} view */
export const previousProblem = (view) =>
  goTo(view, (at, all) => all.findLast(({ to }) => to < at) ?? all.at(-1));

/** @param {EditorView} view @param {(at: number, all: Range[]) => Range | undefined} chosen */
function goTo(view, chosen) {
  /** @type {Range[]} */
  const all = [];
  for (const at = view.state.field(problems).iter(); at.value; at.next())
    if (at.value === CULPRIT) all.push({ from: at.from, to: at.to });
  const found = chosen(view.state.selection.main.from, all);
  if (!found) return false;
  view.dispatch({ selection: { anchor: found.from, head: found.to }, scrollIntoView: true });
  return true;
}
