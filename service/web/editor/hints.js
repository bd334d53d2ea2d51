// What the scene language says about the field under the pointer, or at the cursor with Ctrl + I.

import { get } from "../api.js";
import { announce, h } from "../dom.js";
import { quoted } from "../elements.js";
import { fieldAt } from "../scene_fields.js";
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

const VALUES = new Set(["String", "Number", "True", "False", "Null"]);
const setTip = StateEffect.define();

let schema = null;

/** The JSON Schema of scenes; a failed request is made again the next time. */
function sceneSchema() {
  schema ??= get("/v1/schemas/scene.json").catch(() => (schema = null));
  return schema;
}

const tips = StateField.define({
  create: () => null,
  update(tip, transaction) {
    const sent = transaction.effects.find((one) => one.is(setTip));
    if (sent) return sent.value;
    return transaction.docChanged || transaction.selection ? null : tip;
  },
  provide: (field) => showTooltip.from(field),
});

export const hints = () => [
  hoverTooltip((view, at, side) => tipAt(view.state, at, side)),
  tips,
  keymap.of([
    { key: "Mod-i", run: show },
    { key: "Escape", run: hide },
  ]),
];

function show(view) {
  const { state } = view;
  tipAt(state, state.selection.main.head, 1).then((tip) => {
    const moved = view.state.doc !== state.doc || !view.state.selection.eq(state.selection);
    if (moved || !tip) return;
    view.dispatch({ effects: setTip.of(tip) });
    announce(tip.text);
  });
  return true;
}

function hide(view) {
  if (!view.state.field(tips) && !hasHoverTooltips(view.state)) return false;
  view.dispatch({ effects: [setTip.of(null), closeHoverTooltips] });
  return true;
}

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
    text: [field.name, ...field.paragraphs, field.facts].join("\n"),
    create: () => ({ dom: described(field) }),
  };
}

function described({ name, paragraphs, facts }) {
  return h(
    "div",
    { className: "field-hint" },
    h("p", { className: "field-name" }, h("code", {}, name)),
    paragraphs.map((text) => h("p", {}, quoted(text))),
    facts && h("p", { className: "soft" }, facts),
  );
}

/**
 * The way from the document to a node of its syntax tree.
 *
 * @returns {import("../scene_fields.js").Step[]}
 */
function stepsTo(doc, node) {
  const steps = [];
  for (let at = node; at.parent; at = at.parent) {
    if (at.name === "Property")
      steps.unshift({
        name: nameOf(doc, at),
        type: typeOf(doc, at.parent),
        inner: typeOf(doc, at.lastChild),
      });
    else if (at.parent.name === "Array") steps.unshift({ name: null, type: null, inner: typeOf(doc, at) });
  }
  return steps;
}

const textOf = (doc, node) => doc.sliceString(node.from, node.to);

function nameOf(doc, property) {
  const written = textOf(doc, property.getChild("PropertyName"));
  try {
    return JSON.parse(written);
  } catch {
    return written;
  }
}

/** The member `type` of an object, or null. */
function typeOf(doc, node) {
  if (node?.name !== "Object") return null;
  const kind = node.getChildren("Property").find((property) => nameOf(doc, property) === "type");
  const value = kind?.getChild("String");
  return value ? textOf(doc, value).slice(1, -1) : null;
}
