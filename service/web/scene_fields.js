// What the JSON Schema of scenes says about a field, for people.

// Bounds beyond these only keep arithmetic finite.
const HUGE = 1e15;
const TINY = 1e-100;

/**
 * @typedef {object} Step
 * @property {string | null} name - Of a member of an object; null for an element of an array.
 * @property {string | null} type - The object's own `type`.
 * @property {string | null} inner - The `type` of the value, if that is an object.
 */

/**
 * @typedef {{name: string, paragraphs: string[], facts: string}} FieldText
 * @typedef {{name: string, at: SchemaNode, owner: SchemaNode, inner: string | null}} Field
 */

/**
 * Find a field of the scene language.
 *
 * @param {SchemaNode} schema - The JSON Schema of scenes.
 * @param {Step[]} steps - The way to the field.
 * @returns {FieldText | null} Null where the language has no such field.
 */
export function fieldAt(schema, steps) {
  let at = schema;
  /** @type {Field | null} */
  let field = null;
  for (const { name, type, inner } of steps) {
    const owners = variants(schema, at, type);
    const owner = owners.find((one) => partOf(one, name));
    const part = owner && partOf(owner, name);
    if (!part) return null;
    at = part;
    if (name !== null) field = { name, at, owner, inner };
  }
  return field && written(schema, field);
}

/** @param {SchemaNode} owner @param {string | null} name */
const partOf = (owner, name) =>
  name === null ? owner.items : owner.properties?.[name] || owner.additionalProperties;

/** @param {SchemaNode} schema @param {Field} field @returns {FieldText} */
function written(schema, { name, at, owner, inner }) {
  const found = variants(schema, at, inner);
  // Of several kinds none is described, unless its `type` is written.
  const target = found.length === 1 || inner ? found[0] : null;
  // A type has no text of its own: the object that it chooses has.
  const text = at.description ?? (at.const === undefined ? target?.description : owner.description);
  const facts = [kind(target), range(target?.items ?? target), standard(at, owner, name)];
  return {
    name,
    paragraphs: text ? text.split("\n\n").slice(0, 1) : [],
    facts: facts.filter(Boolean).join(" · "),
  };
}

/**
 * The alternatives that a `type` leaves, behind references: an ellipsoid may be written in two ways.
 *
 * @param {SchemaNode} schema
 * @param {SchemaNode} at
 * @param {string | null} type
 * @returns {SchemaNode[]}
 */
function variants(schema, at, type) {
  const target = at.$ref ? schema.$defs?.[at.$ref.slice("#/$defs/".length)] : at;
  const choices = target?.oneOf ?? target?.anyOf;
  if (!choices) return target && target.type !== "null" ? [target] : [];
  const all = choices.flatMap((choice) => variants(schema, choice, type));
  return type === null ? all : all.filter((one) => one.properties?.type?.const === type);
}

/** @type {Record<string, string>} */
const KINDS = { number: "a number", integer: "a whole number", string: "text", boolean: "true or false" };
/** @type {Record<string, string>} */
const MANY = { number: "numbers", integer: "whole numbers", string: "texts" };

/** @param {SchemaNode | null} target */
function kind(target) {
  if (!target) return null;
  if (target.enum) return `one of ${target.enum.join(", ")}`;
  if (target.type !== "array") return KINDS[target.type ?? ""];
  const { items, minItems, maxItems } = target;
  const many = MANY[items?.type ?? ""];
  return minItems === maxItems && many ? `${minItems} ${many}` : null;
}

/** @param {SchemaNode | null} target */
function range(target) {
  const { minimum: least, maximum: most, exclusiveMinimum: above, exclusiveMaximum: below } = target ?? {};
  const bounded = least !== undefined && Math.abs(least) < HUGE && (least > TINY || least <= 0);
  const low = bounded ? least : undefined;
  const high = most !== undefined && most < HUGE ? most : undefined;
  if (low !== undefined && high !== undefined) return `${low} to ${high}`;
  if (above !== undefined && below !== undefined) return `between ${above} and ${below}`;
  if (low !== undefined) return `${low} or more`;
  if (above !== undefined || least === TINY) return `more than ${above ?? 0}`;
  return high === undefined ? null : `at most ${high}`;
}

/** @param {SchemaNode} at @param {SchemaNode} owner @param {string} name */
function standard({ default: value }, owner, name) {
  if (owner.required?.includes(name)) return "required";
  const plain = value !== undefined && value !== null && !(Array.isArray(value) && value.length === 0);
  return plain ? `by default ${JSON.stringify(value).replaceAll(",", ", ")}` : null;
}
