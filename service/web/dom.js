// Elements without markup in strings: text is text, whatever it contains.

/** The address of a file of the page, with the version that the address of this module has. @param {string} path */
export const ofPage = (path) => new URL(path, import.meta.url).pathname;

/** @typedef {Node | string | null | undefined | false} Child */

/**
 * Make an element, such as `h("p.soft", { title }, "text")`.
 *
 * The tag may have classes behind it, and the properties may be left out. A name that begins with "on" adds a listener, a
 * property of the element (`value`, `disabled`) is set, and any other name becomes an attribute. `false`, `null` and
 * `undefined` are skipped. A button submits nothing unless its type says so.
 *
 * @template {string} Selector
 * @param {Selector & (TagOf<Selector> extends never ? never : Selector)} selector
 * @param {[(ElementProperties<ElementOf<Selector>> | Child | Child[])?, ...(Child | Child[])[]]} rest
 * @returns {ElementOf<Selector>}
 */
export function h(selector, ...rest) {
  const [tag, ...classes] = selector.split(".");
  const element = document.createElement(tag);
  if (classes.length) element.className = classes.join(" ");
  if (element instanceof HTMLButtonElement) element.type = "button";
  if (isProperties(rest[0])) set(element, /** @type {object} */ (rest.shift()));
  const children = /** @type {(Child | Child[])[]} */ (rest).flat();
  element.append(
    .../** @type {(Node | string)[]} */ (
      children.filter((child) => child !== null && child !== undefined && child !== false)
    ),
  );
  return /** @type {ElementOf<Selector>} */ (element);
}

/** @param {unknown} value */
const isProperties = (value) =>
  typeof value === "object" && value !== null && !Array.isArray(value) && !(value instanceof Node);

/** @param {HTMLElement} element @param {object} properties */
function set(element, properties) {
  const fields = /** @type {Record<string, unknown>} */ (/** @type {unknown} */ (element));
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), /** @type {EventListener} */ (value));
    else if (name in element && name !== "list" && name !== "form") fields[name] = value;
    else element.setAttribute(name, value === true ? "" : String(value));
  }
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

/**
 * Events with details, heard until its life ends.
 *
 * @template {object} Events - The type of the detail of each event, by name.
 */
export class Emitter extends EventTarget {
  life = new AbortController();

  /** Aborted at the end. */
  get signal() {
    return this.life.signal;
  }

  /**
   * @template {keyof Events & string} Type
   * @param {Type} type
   * @param {(detail: Events[Type]) => void} listener
   */
  on(type, listener) {
    const heard = (/** @type {Event} */ event) => listener(/** @type {CustomEvent} */ (event).detail);
    this.addEventListener(type, heard, { signal: this.signal });
  }

  /** @template {keyof Events & string} Type @param {Type} type @param {Events[Type]} detail */
  emit(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
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
