// What the JSON Schema of scenes says about fields: for people, and what may be written at a place.

import { get } from "./api.js";

// Bounds beyond these only keep arithmetic finite.
const HUGE = 1e15;
const TINY = 1e-100;

/** @type {Promise<SchemaNode | null> | null} */
let schema = null;

/** The JSON Schema of scenes; a failed request is made again the next time. @returns {Promise<SchemaNode | null>} */
export function sceneSchema() {
  schema ??= get("/v1/schemas/scene.json").catch(() => (schema = null));
  return schema;
}

/**
 * @typedef {object} Step
 * @property {string | null} name - Of a member of an object; null for an element of an array.
 * @property {string | null} type - The object's own `type`.
 * @property {string | null} inner - The `type` of the value, if that is an object.
 */

/**
 * @typedef {{name: string, text: string, facts: string}} FieldText
 * @typedef {{name: string, at: SchemaNode, owner: SchemaNode, inner: string | null}} Field
 */

/**
 * Find a field of the scene language.
 *
 * @param {SchemaNode} schema - The JSON Schema of scenes.
 * @param {Step[]} steps - The way to the field, or into its value.
 * @returns {FieldText | null} Null where the language has no such field.
 */
export function fieldAt(schema, steps) {
  const { parts, fields } = follow(schema, steps);
  return parts.length && fields.length ? written(schema, fields) : null;
}

/**
 * The fields that an object may have, required ones first, then those of which one of two sets is needed.
 *
 * @param {SchemaNode} schema
 * @param {Step[]} steps - The way to the object.
 * @param {string | null} type - The object's own `type`.
 * @param {string[]} present - The object's fields, which choose among the ways to write it.
 */
export function fieldsOf(schema, steps, type, present) {
  const all = follow(schema, steps).parts.flatMap((part) => variants(schema, part, type));
  const fitting = all.filter(({ properties = {} }) => present.every((name) => name in properties));
  const owners = fitting.length ? fitting : all;
  const names = new Set(owners.flatMap(({ properties }) => Object.keys(properties ?? {})));
  const fields = Array.from(names, (name) => {
    const field = fieldAt(schema, [...steps, { name, type, inner: null }]);
    return field && { ...field, need: needOf(owners, name) };
  });
  const rank = (/** @type {string} */ need) => (need === "required" ? 0 : need ? 1 : 2);
  return fields.filter((field) => field !== null).sort((a, b) => rank(a.need) - rank(b.need));
}

/** Whether a field is required, or what may stand in its place. @param {SchemaNode[]} owners @param {string} name */
function needOf(owners, name) {
  const [needing, others] = [true, false].map((needed) =>
    owners.filter(({ required }) => (required?.includes(name) ?? false) === needed),
  );
  if (!needing.length) return "";
  if (!others.length) return "required";
  const kinds = new Set(owners.map(({ properties }) => properties?.type?.const));
  const instead = others[0].required?.filter((other) => !needing[0].required?.includes(other)) ?? [];
  return kinds.size === 1 && instead.length ? `or ${instead.join(", ")}` : "";
}

/**
 * The values among which a field has to have one, with the text of the object that each chooses.
 *
 * @param {SchemaNode} schema
 * @param {Step[]} steps - The way to the field.
 * @returns {Map<unknown, string>}
 */
export function valuesAt(schema, steps) {
  const last = steps.at(-1);
  if (!last?.name) return new Map();
  // A type that is about to change chooses nothing.
  const way = last.name === "type" ? steps.with(-1, { ...last, type: null }) : steps;
  const found = new Map();
  for (const { at, owner } of follow(schema, way).fields)
    for (const { const: only, enum: some, type } of variants(schema, at, null)) {
      const values = some ?? (type === "boolean" ? [true, false] : []);
      if (only !== undefined) found.set(only, found.get(only) ?? firstOf(owner.description));
      for (const value of values) found.set(value, "");
    }
  return found;
}

/**
 * Go some steps into the schema, along all alternatives.
 *
 * @param {SchemaNode} schema
 * @param {Step[]} steps
 * @returns {{parts: SchemaNode[], fields: Field[]}} Where the steps end, and the last field on each way.
 */
function follow(schema, steps) {
  let parts = [schema];
  /** @type {Field[]} */
  let fields = [];
  for (const { name, type, inner } of steps) {
    const found = parts
      .flatMap((part) => variants(schema, part, type))
      .flatMap((owner) => {
        const at = partOf(owner, name);
        return at ? [{ name: name ?? "", at, owner, inner }] : [];
      });
    parts = found.map(({ at }) => at);
    if (name !== null) fields = found;
  }
  return { parts, fields };
}

/** @param {SchemaNode} owner @param {string | null} name */
const partOf = (owner, name) =>
  name === null ? owner.items : owner.properties?.[name] || owner.additionalProperties;

/** What is said about a field of one or several alternatives. @param {SchemaNode} schema @param {Field[]} fields @returns {FieldText} */
function written(schema, fields) {
  const { name, at, owner, inner } = fields[0];
  const found = variants(schema, at, inner);
  // Of several kinds none is described, unless its `type` is written.
  const target = found.length === 1 || inner ? found[0] : null;
  // A type has no text of its own: the object that it chooses has.
  const chosen = fields.every((field) => field.at.const === at.const) ? owner.description : "";
  const text = at.description ?? (at.const === undefined ? target?.description : chosen);
  const facts = [kind(target), range(target?.items ?? target), standard(at, owner, name)];
  return { name, text: firstOf(text), facts: facts.filter(Boolean).join(" · ") };
}

/** The first paragraph of a text. @param {string} [text] */
const firstOf = (text = "") => text.split("\n\n")[0];

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
