// A small picture of the scene beside its text, while it is edited. It creates no job.

import { Problem, Unreachable, request } from "../../api.js";
import { debounced, h, pause } from "../../dom.js";
import { requestText } from "../../requests.js";

// Pixels along the longer side.
const SIDE = 128;
const IDLE_MS = 300;
// Seconds before a busy service is asked again, unless it sends Retry-After.
const RETRY_SECONDS = 2;
// Where the choice is kept, in the browser.
const OFF = "penumbra-preview-off";

/** @param {AbortSignal} signal */
export function makePreview(signal) {
  const picture = h("img", { alt: "Preview of the scene", hidden: true });
  const state = h("span", { className: "soft small" });
  const live = h("input", { type: "checkbox", checked: !isOff(), onchange: choose });
  const element = h(
    "div",
    { className: "preview" },
    h("div", { className: "preview-picture" }, picture),
    h("div", {}, h("label", {}, live, " Live preview"), state),
  );
  // The last valid scene; null while there is none.
  let scene = null;
  let asking = null;
  const later = debounced(IDLE_MS, ask, signal);
  signal.addEventListener("abort", () => {
    asking?.abort();
    URL.revokeObjectURL(picture.src);
  });

  async function ask() {
    if (scene === null || !live.checked) return;
    asking = new AbortController();
    const { signal: current } = asking;
    try {
      const content = await rendered(requestText(scene, { side: SIDE }), current);
      if (!current.aborted) show(content);
    } catch (error) {
      if (!current.aborted) report("stale", reason(error));
    }
  }

  function show(content) {
    URL.revokeObjectURL(picture.src);
    picture.src = URL.createObjectURL(content);
    picture.hidden = false;
    report("current", "");
  }

  function report(name, text) {
    element.dataset.state = name;
    state.textContent = text;
  }

  function choose() {
    keepOff(!live.checked);
    asking?.abort();
    if (live.checked && scene !== null) report("waiting", "Rendering …");
    else report("stale", "");
    ask();
  }

  return {
    element,
    /** Show this scene, which is valid. */
    want(text) {
      asking?.abort();
      scene = text;
      if (live.checked) report("waiting", "Rendering …");
      later();
    },
    /** The scene has no picture now: it has errors, or the service does not answer. */
    wait() {
      asking?.abort();
      scene = null;
      if (live.checked) report("stale", picture.hidden ? "" : "of the last valid scene");
    },
  };
}

/** Get the picture, retrying while the service is busy. */
async function rendered(body, signal) {
  while (true) {
    try {
      const response = await request("/v1/previews", {
        method: "POST",
        type: "application/json",
        body,
        signal,
      });
      return await response.blob();
    } catch (error) {
      const busy = error instanceof Problem && (error.status === 429 || error.status === 503);
      if (!busy) throw error;
      await pause(1000 * (error.retryAfter ?? RETRY_SECONDS), signal);
      signal.throwIfAborted();
    }
  }
}

const reason = (error) =>
  error instanceof Problem || error instanceof Unreachable ? error.message : "There is no preview.";

// Where storage is forbidden, the choice lasts until the page is left.
function isOff() {
  try {
    return localStorage.getItem(OFF) !== null;
  } catch {
    return false;
  }
}

function keepOff(off) {
  try {
    if (off) localStorage.setItem(OFF, "yes");
    else localStorage.removeItem(OFF);
  } catch {
    // Nothing to keep it in.
  }
}
