// The plan of this job. A click on a pointer shows its line of the scene.

import { get, jobPath, messageOf, text } from "../../api.js";
import { h } from "../../dom.js";
import { makeList } from "../../elements.js";
import { makeEditor } from "../../editor.js";
import { plural } from "../../format.js";
import { places, pointerParts } from "../../json_text.js";
import { inScene, takenApart } from "../../requests.js";
import { folded, makeStages } from "./stages.js";

// Further lines are hidden behind a button, to keep the list short.
const SHOWN = 3;

/** @import { Frame } from "../picture/frame.js" @import { Watch } from "../../watch.js" */
/** @typedef {(pointers: string[]) => Node} Lines Makes links to the lines of the scene. */

/** @param {Frame} frame @param {Watch} watch */
export function mount({ drawer }, watch) {
  const editor = makeEditor({ label: "The scene of this job", readOnly: true, signal: watch.signal });
  const stages = h("div.plan-stages");
  drawer.panels.plan.append(
    h("h2.unseen", "What runs, and why"),
    stages,
    h("div.plan-scene", editor.element),
  );
  fill().catch((error) => {
    if (!watch.signal.aborted) stages.replaceChildren(h("p.problem", messageOf(error)));
  });

  async function fill() {
    const { signal } = watch;
    /** @type {[PlanDocument, string]} */
    const [plan, body] = await Promise.all([
      get(`${jobPath(watch.id)}/plan`, { signal }),
      text(`${jobPath(watch.id)}/request`, { signal }),
    ]);
    const { scene } = takenApart(body);
    editor.text = scene;
    const lines = makeLines(scene, plan, editor);
    stages.replaceChildren(h("div", makeStages(plan.stages, lines), rest(plan, lines)));
  }
}

/** @param {PlanDocument} plan @param {Lines} lines */
function rest({ pilot_samples: pilots, left_out: out }, lines) {
  const title = `Pilot samples for the target error: ${plural(pilots.length, "stage")}`;
  const omitted = makeList("ul.left-out", out, ({ effect, reason, pointers }) => [
    h("strong", effect.replaceAll(/[._]/g, " ")),
    h("span.soft", ` ${reason}`),
    pointers.length > 0 && lines(pointers),
  ]);
  return [
    pilots.length > 0 && folded(title, pilots, lines),
    omitted &&
      h("details", { open: true }, h("summary", `Left out: ${plural(out.length, "effect")}`), omitted),
  ];
}

/**
 * Make a function that turns pointers into buttons that show their lines.
 *
 * @param {string} scene
 * @param {PlanDocument} plan
 * @param {import("../../editor.js").Editor} editor
 * @returns {Lines}
 */
function makeLines(scene, plan, editor) {
  const all = [...plan.stages, ...plan.pilot_samples, ...plan.left_out].flatMap(({ pointers }) =>
    pointers.map(inScene),
  );
  const where = places(scene, all);
  const document = JSON.parse(scene);

  /** @param {string} inRequest */
  function link(inRequest) {
    const pointer = inScene(inRequest);
    const place = where.get(pointer);
    if (!place) return h("li.small.soft", pointer);
    const button = h(
      "button.line-link",
      { onclick: () => editor.point(place.start, place.end, { focus: false }) },
      h("span.soft", `line ${place.line}`),
      ` ${named(document, pointer)}`,
    );
    return h("li", button);
  }

  return (pointers) => {
    const shown = pointers.length > SHOWN + 1 ? pointers.slice(0, SHOWN) : pointers;
    const hidden = pointers.slice(shown.length);
    const list = h("ul.line-links", shown.map(link));
    if (hidden.length) {
      /** @type {HTMLLIElement} */
      const more = h(
        "li",
        h(
          "button.line-link",
          { onclick: () => more.replaceWith(...hidden.map(link)) },
          `${hidden.length} more`,
        ),
      );
      list.append(more);
    }
    return list;
  };
}

/** The name in the scene of what a pointer refers to. @param {unknown} document @param {string} pointer */
function named(document, pointer) {
  const parts = pointerParts(pointer);
  const inner = (/** @type {unknown} */ outer, /** @type {string} */ name) =>
    /** @type {Record<string, unknown> | null | undefined} */ (outer)?.[name];
  const name = inner(parts.reduce(inner, document), "name");
  if (typeof name === "string") return name;
  const [group, number, ...rest] = parts;
  const item = /^\d+$/.test(number ?? "")
    ? `${group.replace(/s$/, "")} ${number}`
    : [group, number].filter(Boolean).join(" ");
  return [group === "materials" || group === "textures" ? number : item, ...rest]
    .join(" ")
    .replaceAll("_", " ");
}
