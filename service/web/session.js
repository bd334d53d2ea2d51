// Authentication: the page asks for a key once, and exchanges it for a cookie that scripts cannot read.

import { h } from "./dom.js";
import { navigate } from "./navigation.js";
import { forgetWork } from "./storage.js";

const PATH = "/v1/session";
// To the other tabs: the session has ended.
const ENDED = new BroadcastChannel("penumbra-session-ended");
ENDED.onmessage = left;

/** @type {Promise<boolean> | null} */
let asking = null;
let sessions = 0;
// "Not now" holds until the user asks to sign in.
let declined = false;
// Letters that a header can carry: fetch refuses others as if the service were away.
const SENDABLE = /^[\x21-\x7e]+$/;

/** How many sessions have begun on this page. A request sent before the last one may still be refused. */
export function begunSessions() {
  return sessions;
}

/**
 * Ask for a key and begin a session with it. All callers share one dialog.
 *
 * @param {number} before - `begunSessions` when the refused request was sent.
 * @returns {Promise<boolean>} Whether a session began.
 */
export async function admitted(before) {
  if (sessions > before) return true;
  if (declined) return false;
  asking ??= ask().finally(() => (asking = null));
  return asking;
}

/** A button that asks for a key again, and opens the view again with it. */
export function signInButton() {
  async function signIn() {
    declined = false;
    if (!(await admitted(sessions))) return;
    await showSession(/** @type {HTMLElement} */ (document.getElementById("session")));
    navigate(location.pathname + location.search, { replace: true });
  }
  return h("button.primary", { onclick: signIn }, "Sign in");
}

/** @returns {Promise<boolean>} */
function ask() {
  return new Promise((resolve) => {
    const wrong = h("p.problem", { role: "alert" });
    const key = h("input", {
      type: "password",
      autocomplete: "current-password",
      required: true,
      autofocus: true,
    });
    const form = h(
      "form",
      { onsubmit: send },
      h("h2", "This service requires a key"),
      h(
        "p.soft",
        "Ask the people who run this service for one. Your browser then stores a cookie instead of the key.",
      ),
      h("label.field", h("span.label", "Key"), key),
      wrong,
      h(
        "div.row",
        h("button.primary", { type: "submit" }, "Sign in"),
        h("button", { onclick: () => dialog.close() }, "Not now"),
      ),
    );
    /** @type {HTMLDialogElement} */
    const dialog = h("dialog.session", { "aria-label": "This service requires a key", onclose: ended }, form);

    /** @param {SubmitEvent} event */
    async function send(event) {
      event.preventDefault();
      const answer = await begun(key.value);
      wrong.textContent = answer;
      if (!answer) dialog.close("yes");
    }

    function ended() {
      dialog.remove();
      declined = dialog.returnValue !== "yes";
      resolve(!declined);
    }

    document.body.append(dialog);
    dialog.showModal();
  });
}

/** Begin a session. @param {string} key @returns {Promise<string>} An error message, or an empty string. */
async function begun(key) {
  if (!SENDABLE.test(key)) return "This is no key: keys have letters, digits, - and _ alone.";
  try {
    const response = await fetch(PATH, {
      method: "POST",
      headers: { Authorization: `Bearer ${key}` },
      credentials: "same-origin",
    });
    if (response.ok) {
      sessions += 1;
      return "";
    }
    const { code, detail } = await response.json();
    return code === "unauthenticated" ? "This key is not valid: it may have been revoked." : detail;
  } catch {
    return "The service does not answer.";
  }
}

/**
 * Show the user's name and a button that ends the session, if the service requires keys; to admins a link to its state.
 *
 * @param {HTMLElement} place
 * @returns {Promise<boolean>} Whether they are shown.
 */
export async function showSession(place) {
  const before = sessions;
  const response = await fetch(PATH, { credentials: "same-origin" });
  if (response.status === 401) {
    if (await admitted(before)) return showSession(place);
    place.replaceChildren(signInButton());
    return false;
  }
  const who = response.ok ? await response.json() : null;
  const service = /** @type {HTMLElement} */ (document.querySelector('nav a[href="/service"]'));
  service.hidden = who?.role !== "admin";
  if (!who?.keys_required) return false;
  const leave = h("button.plain", { onclick: end }, "Sign out");
  place.replaceChildren(h("span.soft.small", who.user), leave);
  return true;
}

async function end() {
  await fetch(PATH, { method: "DELETE", credentials: "same-origin" });
  ENDED.postMessage(null);
  await left();
}

/** Leave nothing that the next user could read. */
async function left() {
  await forgetWork();
  location.assign("/");
}
