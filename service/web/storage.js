// Values that the browser keeps for the page. Where storage is full or forbidden, it keeps nothing.

/** @typedef {"localStorage" | "sessionStorage"} Kind `sessionStorage` lasts until the tab is closed. */

let closed = false;

/** @param {Kind} kind @param {string} key @returns {string | null} */
export function kept(kind, key) {
  try {
    return window[kind].getItem(key);
  } catch {
    return null;
  }
}

/** @param {Kind} kind @param {string} key @param {string | null} value - Null removes it. @returns {boolean} Whether it is kept. */
export function keep(kind, key, value) {
  if (closed) return true;
  try {
    // A value that does not fit must not leave an older one behind.
    window[kind].removeItem(key);
    if (value !== null) window[kind].setItem(key, value);
    return true;
  } catch {
    return false;
  }
}

// Texts that are too large for a tab's storage, in IndexedDB under the tab's own name.
const DATABASE = "penumbra";
const STORE = "texts";
const TAB = "penumbra-tab";
// Those of closed tabs are deleted after so many milliseconds.
const LONGEST_MS = 7 * 24 * 3600 * 1000;

/** @param {string} key */
function ofTab(key) {
  const tab = kept("sessionStorage", TAB) ?? crypto.getRandomValues(new Uint32Array(2)).join("-");
  keep("sessionStorage", TAB, tab);
  return `${tab} ${key}`;
}

/**
 * Run a request on the store of large texts.
 *
 * @template T
 * @param {(store: IDBObjectStore) => IDBRequest<T>} ask
 * @returns {Promise<T>}
 */
function stored(ask) {
  return new Promise((done, failed) => {
    const opening = indexedDB.open(DATABASE, 1);
    opening.onupgradeneeded = () => opening.result.createObjectStore(STORE);
    opening.onerror = () => failed(opening.error);
    opening.onsuccess = () => {
      const database = opening.result;
      const transaction = database.transaction(STORE, "readwrite");
      const asked = ask(transaction.objectStore(STORE));
      transaction.oncomplete = () => (database.close(), done(asked.result));
      transaction.onabort = () => (database.close(), failed(transaction.error));
    };
  });
}

/** @param {string} key @returns {Promise<string | null>} */
export async function keptLarge(key) {
  const found = await stored((store) => store.get(ofTab(key))).catch(() => null);
  return found?.text ?? null;
}

/** @param {string} key @param {string} text */
export async function keepLarge(key, text) {
  if (closed) return;
  const now = Date.now();
  await stored((store) => {
    store.openCursor().onsuccess = ({ target }) => {
      const cursor = /** @type {IDBRequest<IDBCursorWithValue | null>} */ (target).result;
      if (!cursor) return;
      if (cursor.value.at < now - LONGEST_MS) cursor.delete();
      cursor.continue();
    };
    return store.put({ at: now, text }, ofTab(key));
  });
}

/** Forget the work of a user who signs out, and keep nothing from now on: a draft is stored when the page is left. */
export async function forgetWork() {
  closed = true;
  try {
    sessionStorage.clear();
    await stored((store) => store.clear());
  } catch {
    // Nothing was kept.
  }
}
