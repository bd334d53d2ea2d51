// Elements without markup in strings: text is text, whatever it contains.

/** The address of a file of the page, with the version that the address of this module has. @param {string} path */
export const ofPage = (path) => new URL(path, import.meta.url).pathname;

/** @typedef {Node | string | null | undefined | false} Child */

/**
 * Make an element.
 *
 * A name that begins with "on" adds a listener, a property of the element (`className`, `value`, `disabled`) is set, and
 * any other name becomes an attribute. `false`, `null` and `undefined` are skipped.
 *
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {ElementProperties<HTMLElementTagNameMap[Tag]>} properties
 * @param {(Child | Child[])[]} children
 * @returns {HTMLElementTagNameMap[Tag]}
 */
export function h(tag, properties = /** @type {{}} */ ({}), ...children) {
  const element = document.createElement(tag);
  const fields = /** @type {Record<string, unknown>} */ (/** @type {unknown} */ (element));
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), /** @type {EventListener} */ (value));
    else if (name in element && name !== "list" && name !== "form") fields[name] = value;
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(
    .../** @type {(Node | string)[]} */ (
      children.flat().filter((child) => child !== null && child !== undefined && child !== false)
    ),
  );
  return element;
}

/**
 * Make an element of SVG; all properties are attributes.
 *
 * @template {keyof SVGElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Record<string, string | number>} properties
 * @param {(Node | string)[]} children
 * @returns {SVGElementTagNameMap[Tag]}
 */
export function svg(tag, properties = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(properties)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

/** Announce a text to screen readers without showing it. @param {string} text */
export function announce(text) {
  const announcer = document.getElementById("announcer");
  if (announcer) announcer.textContent = text;
}

/**
 * Delay calls of a function until none has come for some milliseconds. Aborting the signal cancels a pending call.
 *
 * @template {unknown[]} Values
 * @param {number} wait
 * @param {(...values: Values) => void} call
 * @param {AbortSignal} [signal]
 * @returns {(...values: Values) => void}
 */
export function debounced(wait, call, signal) {
  let timer = 0;
  signal?.addEventListener("abort", () => clearTimeout(timer));
  return (...values) => {
    clearTimeout(timer);
    if (!signal?.aborted) timer = setTimeout(call, wait, ...values);
  };
}

/**
 * Wait some milliseconds, or until the signal is aborted.
 *
 * @param {number} wait
 * @param {AbortSignal} [signal]
 * @returns {Promise<void>}
 */
export function pause(wait, signal) {
  return new Promise((resolve) => {
    if (signal?.aborted) return resolve();
    const timer = setTimeout(done, wait);
    function done() {
      clearTimeout(timer);
      signal?.removeEventListener("abort", done);
      resolve();
    }
    signal?.addEventListener("abort", done);
  });
}
