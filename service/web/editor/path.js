// Where in a document the nodes of the editor's syntax tree are. The tree has nodes for what is not yet JSON too.

/** @import { SyntaxNode, Text } from "../vendor/codemirror/codemirror.js" */
/** @import { Step } from "../scene_fields.js" */

/**
 * The way from the document to a node of its syntax tree.
 *
 * @param {Text} doc
 * @param {SyntaxNode} node
 * @returns {Step[]}
 */
export function stepsTo(doc, node) {
  /** @type {Step[]} */
  const steps = [];
  for (let at = node, { parent } = at; parent; at = parent, { parent } = at) {
    if (at.name === "Property")
      steps.unshift({
        name: nameOf(doc, at),
        type: typeOf(doc, parent),
        inner: typeOf(doc, at.lastChild),
      });
    else if (parent.name === "Array") steps.unshift({ name: null, type: null, inner: typeOf(doc, at) });
  }
  return steps;
}

/** @param {Text} doc @param {SyntaxNode} node */
const textOf = (doc, node) => doc.sliceString(node.from, node.to);

/** @param {Text} doc @param {SyntaxNode} property @returns {string} */
function nameOf(doc, property) {
  const name = property.getChild("PropertyName");
  const written = name ? textOf(doc, name) : "";
  try {
    return JSON.parse(written);
  } catch {
    return written;
  }
}

/**
 * The names of an object's members.
 *
 * @param {Text} doc
 * @param {SyntaxNode | null} object
 * @param {number} [except] - Where a member begins that does not count.
 */
export function namesIn(doc, object, except) {
  const members = object?.getChildren("Property") ?? [];
  return members.filter(({ from }) => from !== except).map((property) => nameOf(doc, property));
}

/** A member's value. @param {Text} doc @param {SyntaxNode | null} object @param {string} name */
export const member = (doc, object, name) =>
  object?.getChildren("Property").find((property) => nameOf(doc, property) === name)?.lastChild ?? null;

/** The member `type` of an object, or null. @param {Text} doc @param {SyntaxNode | null} node */
export function typeOf(doc, node) {
  const value = node?.name === "Object" ? member(doc, node, "type") : null;
  return value?.name === "String" ? textOf(doc, value).slice(1, -1) : null;
}
