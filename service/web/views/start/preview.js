// A picture of the scene beside its text, while it is edited. It creates no job.

import { Problem, Unreachable, request, whenFree } from "../../api.js";
import { debounced, h } from "../../dom.js";
import { requestText } from "../../requests.js";
import { keep, kept } from "../../storage.js";

// Pixels along the longer side: of a first picture that comes fast, and of one that the quote does not wait long for.
const FIRST_SIDE = 128;
const LARGEST_SIDE = 384;
const IDLE_MS = 300;
// Where the choice is kept, in the browser.
const OFF = "penumbra-preview-off";

/** @param {AbortSignal} signal */
export function makePreview(signal) {
  const picture = h("img", { alt: "Preview of the scene", hidden: true });
  const state = h("span", { className: "soft small" });
  /** @type {HTMLInputElement} */
  const live = h("input", {
    type: "checkbox",
    checked: kept("localStorage", OFF) === null,
    onchange: choose,
  });
  const frame = h("div", { className: "preview-picture" }, picture);
  const element = h(
    "div",
    { className: "preview" },
    frame,
    h("div", { className: "row" }, h("label", {}, live, " Live preview"), state),
  );
  // The last valid scene; null while there is none.
  /** @type {string | null} */
  let scene = null;
  /** @type {AbortController | null} */
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
    let shown = false;
    try {
      for (const side of [FIRST_SIDE, largestSide()]) {
        await show(await rendered(requestText(scene, { side }), current), current);
        shown = true;
        // That is the whole picture.
        if (Math.max(picture.naturalWidth, picture.naturalHeight) < side) break;
      }
      if (!current.aborted) report("current", "");
    } catch (error) {
      // Only a small one may be cheap enough.
      if (!current.aborted) report(shown ? "current" : "stale", shown ? "" : reason(error));
    }
  }

  /** As many pixels as are shown. */
  function largestSide() {
    const shown = devicePixelRatio * Math.max(frame.clientWidth, frame.clientHeight);
    return Math.round(Math.min(LARGEST_SIDE, Math.max(FIRST_SIDE, shown)));
  }

  /** @param {Blob} content @param {AbortSignal} current */
  async function show(content, current) {
    current.throwIfAborted();
    URL.revokeObjectURL(picture.src);
    picture.src = URL.createObjectURL(content);
    picture.hidden = false;
    await picture.decode();
  }

  /** @param {"current" | "waiting" | "stale"} name @param {string} text */
  function report(name, text) {
    element.dataset.state = name;
    state.textContent = text;
  }

  function choose() {
    keep("localStorage", OFF, live.checked ? null : "yes");
    asking?.abort();
    if (live.checked && scene !== null) report("waiting", "Rendering …");
    else report("stale", "");
    ask();
  }

  return {
    element,
    /** Show this scene, which is valid. @param {string} text */
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

/** @param {string} body @param {AbortSignal} signal */
async function rendered(body, signal) {
  const options = { method: "POST", type: "application/json", body, signal };
  return (await whenFree(() => request("/v1/previews", options), signal)).blob();
}

/** @param {unknown} error */
const reason = (error) =>
  error instanceof Problem || error instanceof Unreachable ? error.message : "There is no preview.";
