// What the scene language says about the field under the pointer, or at the cursor with Ctrl + I.

import { announce, h } from "../dom.js";
import { quoted } from "../elements.js";
import { fieldAt, sceneSchema } from "../scene_fields.js";
import {
  StateEffect,
  StateField,
  closeHoverTooltips,
  hasHoverTooltips,
  hoverTooltip,
  keymap,
  showTooltip,
  syntaxTree,
} from "../vendor/codemirror/codemirror.js";
import { stepsTo } from "./path.js";

/** @import { EditorState, EditorView, StateEffectType, Tooltip } from "../vendor/codemirror/codemirror.js" */
/** @import { FieldText } from "../scene_fields.js" */
/** @typedef {Tooltip & {end: number, text: string}} Tip */

const VALUES = new Set(["String", "Number", "True", "False", "Null"]);
/** @type {StateEffectType<Tip | null>} */
const setTip = StateEffect.define();

const tips = StateField.define({
  create: () => /** @type {Tip | null} */ (null),
  update(tip, transaction) {
    const sent = transaction.effects.find((one) => one.is(setTip));
    if (sent?.is(setTip)) return sent.value;
    return transaction.docChanged || transaction.selection ? null : tip;
  },
  provide: (field) => showTooltip.from(field),
});

export const hints = () => [
  hoverTooltip(async (view, at, side) => {
    const tip = await tipAt(view.state, at, side);
    return view.state.field(tips)?.pos === tip?.pos ? null : tip;
  }),
  tips,
  keymap.of([
    { key: "Mod-i", run: show },
    { key: "Escape", run: hide },
  ]),
];

/** @param {EditorView} view */
function show(view) {
  const { state } = view;
  tipAt(state, state.selection.main.head, 1).then((tip) => {
    const moved = view.state.doc !== state.doc || !view.state.selection.eq(state.selection);
    if (moved || !tip) return;
    view.dispatch({ effects: [setTip.of(tip), closeHoverTooltips] });
    announce(tip.text);
  });
  return true;
}

/** @param {EditorView} view */
function hide(view) {
  if (!view.state.field(tips) && !hasHoverTooltips(view.state)) return false;
  view.dispatch({ effects: [setTip.of(null), closeHoverTooltips] });
  return true;
}

/** @param {EditorState} state @param {number} at @param {-1 | 1} side @returns {Promise<Tip | null>} */
async function tipAt(state, at, side) {
  const node = syntaxTree(state).resolveInner(at, side);
  if (node.name !== "PropertyName" && !VALUES.has(node.name)) return null;
  const known = await sceneSchema();
  const field = known && fieldAt(known, stepsTo(state.doc, node));
  if (!field) return null;
  return {
    pos: node.from,
    end: node.to,
    above: true,
    text: [field.name, field.text, field.facts].join("\n"),
    create: () => ({ dom: described(field) }),
  };
}

/** @param {FieldText} field */
export function described({ name, text, facts }) {
  return h(
    "div",
    { className: "field-hint" },
    h("p", { className: "field-name" }, h("code", {}, name)),
    text && h("p", {}, quoted(text)),
    facts && h("p", { className: "soft" }, facts),
  );
}
