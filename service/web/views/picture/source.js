// The part of the scene that a pointer refers to.

import { jobPath, text } from "../../api.js";
import { h } from "../../dom.js";
import { lineStarts, places } from "../../json_text.js";
import { inScene, takenApart } from "../../requests.js";

const MOST_LINES = 24;

/** @param {string} id - Of the job. @param {string} name - Of its picture among several, or empty. @param {AbortSignal} signal */
export function makeSource(id, name, signal) {
  const title = h("h3", { id: `source-title${name}` });
  const lines = h("pre", { tabIndex: 0, "aria-labelledby": title.id });
  const element = h("section.source", { hidden: true, "aria-labelledby": title.id }, title, lines);
  /** @type {string | null} */
  let scene = null;

  /** @param {string} inRequest - A pointer. */
  async function show(inRequest) {
    const pointer = inScene(inRequest);
    scene ??= takenApart(await text(`${jobPath(id)}/request`, { signal })).scene;
    const place = places(scene, [pointer]).get(pointer);
    title.textContent = place ? `Scene, ${pointer}` : "Not in the scene: this is a default.";
    lines.textContent = place ? excerpt(scene, place) : "";
    lines.hidden = !place;
    element.hidden = false;
    element.scrollIntoView({ block: "nearest" });
  }

  return { element, show, clear: () => (element.hidden = true) };
}

/** @param {string} text @param {import("../../json_text.js").Place} place */
function excerpt(text, { start, end, line }) {
  const begin = lineStarts(text)[line - 1];
  const found = text.slice(begin, end).split("\n");
  const indent = Math.min(
    start - begin,
    ...found
      .slice(1)
      .filter((one) => one.trim())
      .map((one) => one.search(/\S/)),
  );
  const shown = found.slice(0, MOST_LINES).map((one) => one.slice(indent));
  return shown.join("\n") + (found.length > MOST_LINES ? "\n…" : "");
}
