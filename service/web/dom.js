// Elements without markup in strings: text is text, whatever it contains.

/**
 * Make an element.
 *
 * A property whose name begins with "on" is a listener, one that the element has as a property is set so (`className`,
 * `value`, `disabled`), every other one is an attribute. `false`, `null` and `undefined` leave it out.
 */
export function h(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name in element && name !== "list" && name !== "form") element[name] = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(
    ...children.flat().filter((child) => child !== null && child !== undefined && child !== false),
  );
  return element;
}

/** Make an element of SVG; all properties are attributes. */
export function svg(tag, properties = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(properties)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Tell it to screen readers, without a change to what is seen. */
export function announce(text) {
  document.getElementById("announcer").textContent = text;
}

/** Call a function once nothing has asked for it during some milliseconds. Aborting the signal forgets what waits. */
export function debounced(wait, call, signal) {
  let timer = 0;
  signal?.addEventListener("abort", () => clearTimeout(timer));
  return (...values) => {
    clearTimeout(timer);
    if (!signal?.aborted) timer = setTimeout(call, wait, ...values);
  };
}

/** A promise of nothing, after some milliseconds or when the signal is aborted. */
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
