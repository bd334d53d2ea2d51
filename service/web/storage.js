// What the browser keeps for the page. Where storage is full or forbidden, it keeps nothing.

/** @typedef {"localStorage" | "sessionStorage"} Kind `sessionStorage` lasts until the tab is closed. */

/** @param {Kind} kind @param {string} key @returns {string | null} */
export function kept(kind, key) {
  try {
    return window[kind].getItem(key);
  } catch {
    return null;
  }
}

/** @param {Kind} kind @param {string} key @param {string | null} value - Null removes it. */
export function keep(kind, key, value) {
  try {
    // A value that does not fit must not leave an older one behind.
    window[kind].removeItem(key);
    if (value !== null) window[kind].setItem(key, value);
  } catch {
    // Nothing to keep it in.
  }
}
