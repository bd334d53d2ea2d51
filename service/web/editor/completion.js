// Completion in a scene: the fields and values of its JSON Schema, and the names that the scene itself defines.

import { h } from "../dom.js";
import { quoted } from "../elements.js";
import { fieldsOf, sceneSchema, valuesAt } from "../scene_fields.js";
import { acceptCompletion, autocompletion, keymap, syntaxTree } from "../vendor/codemirror/codemirror.js";
import { described } from "./hints.js";
import { member, namesIn, stepsTo, typeOf } from "./path.js";

/** @import { Completion, CompletionContext, CompletionResult, EditorState, SyntaxNode } from "../vendor/codemirror/codemirror.js" */

// What a list is filtered by: a string without its end, or a word without quotes.
const STRING = /^"(?:[^"\\\n]|\\.)*$/;
const WORD = /^\w*$/;
/** Fields whose values are the names of members of the scene. @type {[RegExp, string][]} */
const REFERENCES = [
  [/^material$/, "materials"],
  [/_(texture|map)$/, "textures"],
];
// CodeMirror's greatest: options keep the order in which they are found, where they match equally well.
const MAX_BOOST = 99;

export const completion = () => [
  // No delay: where a list opens by itself, Enter has no other use.
  autocompletion({ override: [complete], icons: false, interactionDelay: 0 }),
  // Without a list Tab leaves the editor.
  keymap.of([{ key: "Tab", run: acceptCompletion }]),
];

/** @param {CompletionContext} context @returns {Promise<CompletionResult | null>} */
async function complete({ state, pos, explicit }) {
  const { from, to } = tokenAt(state, pos);
  // Enter is a new line except in a string, so a list opens by itself only there.
  if (!explicit && state.sliceDoc(from, from + 1) !== '"') return null;
  const schema = await sceneSchema();
  const options = schema ? optionsAt(state, schema, from, to) : [];
  const quote = state.sliceDoc(from, pos).startsWith('"');
  // CodeMirror finds a single letter at the beginning of a label alone, so labels have the quote that is written.
  const ranked = options.map((option, at) => ({
    ...option,
    label: quote ? `"${option.label}"` : option.label,
    displayLabel: option.label,
    boost: MAX_BOOST - at,
  }));
  return ranked.length ? { from, to, options: ranked, validFor: quote ? STRING : WORD } : null;
}

/** What an option replaces: the token that the cursor is in or after. @param {EditorState} state @param {number} pos */
function tokenAt(state, pos) {
  const { from, to } = syntaxTree(state).resolveInner(pos, -1);
  const begun = state.sliceDoc(from, pos);
  if (!STRING.test(begun) && !WORD.test(begun)) return { from: pos, to: pos };
  // A string that was just begun ends, for the parser, where the next one begins.
  const swallowed = /^[^"]*"\w/.test(state.sliceDoc(pos, to + 1));
  return { from, to: swallowed ? pos : to };
}

/**
 * What may be written in place of a token.
 *
 * @param {EditorState} state
 * @param {SchemaNode} schema
 * @param {number} from
 * @param {number} to
 * @returns {Completion[]}
 */
function optionsAt(state, schema, from, to) {
  const { doc } = state;
  const mark = markBefore(syntaxTree(state).resolveInner(from, -1), from);
  const holder = mark?.parent;
  if (mark?.name === ":" && holder) return valueOptions(state, schema, holder);
  if (holder?.name !== "Object" || (mark?.name !== "{" && mark?.name !== ",")) return [];
  const ending = /^\s*:/.test(doc.sliceString(to, doc.lineAt(to).to)) ? "" : ": ";
  const present = namesIn(doc, holder, from);
  return fieldsOf(schema, stepsTo(doc, holder), typeOf(doc, holder), present)
    .filter(({ name }) => !present.includes(name))
    .map((field) => ({
      ...option(field.name),
      apply: JSON.stringify(field.name) + ending,
      detail: field.need,
      info: () => described(field),
    }));
}

/** The bracket, comma or colon before a place, or what else stands there. @param {SyntaxNode} node @param {number} at */
function markBefore(node, at) {
  let mark = node.firstChild ? node.childBefore(at) : node;
  while (mark?.type.isError) mark = mark.prevSibling;
  return mark;
}

/** @param {EditorState} state @param {SchemaNode} schema @param {SyntaxNode} property @returns {Completion[]} */
function valueOptions(state, schema, property) {
  const { doc } = state;
  const steps = stepsTo(doc, property);
  const [, group] = REFERENCES.find(([form]) => form.test(steps.at(-1)?.name ?? "")) ?? [];
  if (!group)
    return Array.from(valuesAt(schema, steps), ([value, text]) => ({
      ...option(value),
      info: text ? () => h("div", { className: "field-hint" }, h("p", {}, quoted(text))) : undefined,
    }));
  const scene = syntaxTree(state).topNode.getChild("Object");
  return namesIn(doc, member(doc, scene, group)).map(option);
}

/** @param {unknown} value @returns {Completion} */
const option = (value) => ({ label: String(value), apply: JSON.stringify(value) });
