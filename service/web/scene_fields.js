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
 * Find a field of the scene language.
 *
 * @param {object} schema - The JSON Schema of scenes.
 * @param {Step[]} steps - The way to the field.
 * @returns {{name: string, paragraphs: string[], facts: string} | null} Null where the language has no such field.
 */
export function fieldAt(schema, steps) {
  let at = schema;
  let field = null;
  for (const { name, type, inner } of steps) {
    const owners = variants(schema, at, type);
    const owner = owners.find((one) => partOf(one, name)) ?? null;
    at = partOf(owner, name);
    if (!at) return null;
    if (name !== null) field = { name, at, owner, inner };
  }
  return field && written(schema, field);
}

const partOf = (owner, name) =>
  name === null ? owner?.items : owner?.properties?.[name] || owner?.additionalProperties;

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

/** The alternatives that a `type` leaves, behind references: an ellipsoid may be written in two ways. */
function variants(schema, at, type) {
  const target = at?.$ref ? schema.$defs[at.$ref.slice("#/$defs/".length)] : at;
  const choices = target?.oneOf ?? target?.anyOf;
  if (!choices) return target && target.type !== "null" ? [target] : [];
  const all = choices.flatMap((choice) => variants(schema, choice, type));
  return type === null ? all : all.filter((one) => one.properties?.type?.const === type);
}

const KINDS = { number: "a number", integer: "a whole number", string: "text", boolean: "true or false" };
const MANY = { number: "numbers", integer: "whole numbers", string: "texts" };

function kind(target) {
  if (!target) return null;
  if (target.enum) return `one of ${target.enum.join(", ")}`;
  if (target.type !== "array") return KINDS[target.type];
  const { items, minItems, maxItems } = target;
  return minItems === maxItems && items && MANY[items.type] ? `${minItems} ${MANY[items.type]}` : null;
}

function range(target) {
  const { minimum: least, maximum: most, exclusiveMinimum: above, exclusiveMaximum: below } = target ?? {};
  const low = Math.abs(least) < HUGE && (least > TINY || least === 0 || least < 0) ? least : undefined;
  const high = most < HUGE ? most : undefined;
  if (low !== undefined && high !== undefined) return `${low} to ${high}`;
  if (above !== undefined && below !== undefined) return `between ${above} and ${below}`;
  if (low !== undefined) return `${low} or more`;
  if (above !== undefined || least === TINY) return `more than ${above ?? 0}`;
  return high === undefined ? null : `at most ${high}`;
}

function standard({ default: value }, owner, name) {
  if (owner.required?.includes(name)) return "required";
  const plain = value !== undefined && value !== null && !(Array.isArray(value) && value.length === 0);
  return plain ? `by default ${JSON.stringify(value).replaceAll(",", ", ")}` : null;
}
