// The JSON editor: CodeMirror with problems under their lines, and what the scene language says about a field.

import { completion } from "./editor/completion.js";
import { hints } from "./editor/hints.js";
import {
  inSight,
  located,
  marks,
  nextProblem,
  pointedLines,
  previousProblem,
  problemLines,
} from "./editor/marks.js";
import { h } from "./dom.js";
import {
  EditorState,
  EditorView,
  bracketMatching,
  codeFolding,
  defaultKeymap,
  foldGutter,
  foldKeymap,
  highlightActiveLine,
  highlightSelectionMatches,
  history,
  historyKeymap,
  indentOnInput,
  json,
  keymap,
  lineNumbers,
  search,
  searchKeymap,
  syntaxHighlighting,
  tagHighlighter,
  tags,
} from "./vendor/codemirror/codemirror.js";

// The colours are in editor.css.
const COLOURS = tagHighlighter([
  { tag: tags.propertyName, class: "key" },
  { tag: tags.string, class: "string" },
  { tag: tags.number, class: "number" },
  { tag: [tags.bool, tags.null], class: "word" },
  { tag: [tags.separator, tags.brace, tags.squareBracket], class: "mark" },
]);
const KEYS = [
  // Of the page, which renders: the editor would insert a line.
  { key: "Mod-Enter", run: () => true },
  { key: "F8", run: nextProblem, shift: previousProblem },
  // Tab is not among them: it leaves the editor.
  ...defaultKeymap,
  ...searchKeymap,
  ...historyKeymap,
  ...foldKeymap,
];
const ALWAYS = [
  lineNumbers(),
  foldGutter({ openText: "▾", closedText: "▸" }),
  codeFolding(),
  json(),
  syntaxHighlighting(COLOURS),
  bracketMatching(),
  highlightSelectionMatches(),
  search({ top: true }),
  EditorState.phrases.of({ "by word": "whole words", regexp: "regular expression" }),
  hints(),
  marks,
  EditorView.domEventHandlers({
    // The page opens files that are dropped; the editor would insert their text.
    drop: (event) => event.dataTransfer?.types.includes("Files"),
    beforeinput: typedOver,
  }),
];
const WRITABLE = [completion(), history(), indentOnInput(), highlightActiveLine()];

/**
 * Replace selected lines by what is typed. Browsers join lines with inline styles, which the page's policy refuses.
 *
 * @param {InputEvent} event
 * @param {EditorView} view
 */
function typedOver(event, view) {
  const { state } = view;
  if (event.inputType !== "insertText" || !event.data || event.isComposing || state.selection.main.empty)
    return false;
  event.preventDefault();
  view.dispatch(state.replaceSelection(event.data), { userEvent: "input.type", scrollIntoView: true });
  return true;
}

/** @typedef {ReturnType<typeof makeEditor>} Editor */

/**
 * Make an editor.
 *
 * @param {{label: string, describedBy?: string, readOnly?: boolean, onInput?: () => void, signal?: AbortSignal}} options -
 *   `signal` ends the editor.
 */
export function makeEditor({ label, describedBy, readOnly = false, onInput = () => {}, signal }) {
  const attributes = {
    "aria-label": label,
    ...(describedBy && { "aria-describedby": describedBy }),
    autocapitalize: "off",
    tabindex: "0",
  };
  const extensions = [
    ALWAYS,
    keymap.of(KEYS),
    readOnly ? EditorState.readOnly.of(true) : WRITABLE,
    EditorView.contentAttributes.of(attributes),
    EditorView.updateListener.of((update) => update.docChanged && onInput()),
  ];
  const element = h("div", { className: readOnly ? "editor readonly" : "editor" });
  const view = new EditorView({ parent: element, extensions });
  signal?.addEventListener("abort", () => view.destroy());

  return {
    element,
    mark: (/** @type {ProblemEntry[]} */ problems) =>
      view.dispatch({ effects: problemLines.of(located(view.state.doc, problems)) }),
    /** Show and select a piece of the text. @param {number} start @param {number} end @param {{focus?: boolean}} options */
    point(start, end, { focus = true } = {}) {
      const range = { from: start, to: end };
      view.dispatch({
        selection: { anchor: start, head: end },
        effects: [pointedLines.of([range]), inSight(view.state.doc, range, "center")],
      });
      if (focus) view.focus();
      element.scrollIntoView({ block: "nearest" });
    },
    get text() {
      return view.state.doc.toString();
    },
    /** Another text; what was written before cannot be undone into it. */
    set text(text) {
      view.setState(EditorState.create({ doc: text, extensions }));
      view.scrollDOM.scrollTo({ top: 0, left: 0 });
    },
  };
}
