// Services with keys: a key is asked for once, and a cookie that scripts cannot read stands for it afterwards.

import { h } from "./dom.js";

const PATH = "/v1/session";

let asking = null;
let sessions = 0;

/** How many sessions have begun on this page: what was sent before the last one may still be refused for want of it. */
export function begunSessions() {
  return sessions;
}

/**
 * Ask for a key and begin a session with it; many may wait for one answer.
 *
 * @param {number} before - `begunSessions` when the request was sent that was refused.
 * @returns {Promise<boolean>} Whether a session began.
 */
export async function admitted(before) {
  if (sessions > before) return true;
  asking ??= ask().finally(() => (asking = null));
  return asking;
}

function ask() {
  return new Promise((resolve) => {
    const wrong = h("p", { className: "problem", role: "alert", hidden: true });
    const key = h("input", {
      type: "password",
      autocomplete: "current-password",
      required: true,
      autofocus: true,
    });
    const form = h(
      "form",
      { onsubmit: send },
      h("h2", {}, "This service asks for a key"),
      h(
        "p",
        { className: "soft" },
        "Whoever runs it gives you one. This browser keeps a cookie in its place.",
      ),
      h("label", { className: "field" }, h("span", { className: "label" }, "Key"), key),
      wrong,
      h(
        "div",
        { className: "row" },
        h("button", { type: "submit", className: "primary" }, "Begin"),
        h("button", { type: "button", onclick: () => dialog.close() }, "Not now"),
      ),
    );
    const dialog = h(
      "dialog",
      { className: "session", "aria-label": "This service asks for a key", onclose: ended },
      form,
    );

    async function send(event) {
      event.preventDefault();
      const answer = await begun(key.value);
      wrong.hidden = answer === "";
      wrong.textContent = answer;
      if (!answer) dialog.close("yes");
    }

    function ended() {
      dialog.remove();
      resolve(dialog.returnValue === "yes");
    }

    document.body.append(dialog);
    dialog.showModal();
  });
}

/** Begin a session; the answer is empty, or what is wrong. */
async function begun(key) {
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
    return (await response.json()).detail;
  } catch {
    return "The service does not answer.";
  }
}

/** Show who the service takes one for, with a way to end the session; nothing where it asks for no keys. */
export async function showSession(place) {
  const before = sessions;
  const response = await fetch(PATH, { credentials: "same-origin" });
  if (response.status === 401) return (await admitted(before)) && showSession(place);
  const who = response.ok ? await response.json() : null;
  if (!who?.keys_required) return false;
  const leave = h("button", { type: "button", className: "plain", onclick: end }, "Leave");
  place.replaceChildren(h("span", { className: "soft small" }, who.user), leave);
  return true;
}

async function end() {
  await fetch(PATH, { method: "DELETE", credentials: "same-origin" });
  location.assign("/");
}
