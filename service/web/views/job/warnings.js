// What is probably not intended: warnings of the job's request, and numerical problems of its picture.

import { h } from "../../dom.js";
import { plural } from "../../format.js";
import { inScene } from "../../requests.js";

/** @import { Frame } from "../picture/frame.js" @import { Watch } from "../../watch.js" */

/** @type {[keyof NonNullable<JobDocument["numerics"]>, string, string][]} */
const NUMERICS = [
  ["non_finite", "pixel", "NaN or infinite"],
  ["clamped", "pixel", "clamped to the largest float32"],
  ["degenerate_dropped", "triangle", "left out: without area, or a copy"],
];

/** @param {Frame} frame @param {Watch} watch */
export function mount({ drawer }, watch) {
  const list = h("ul.warnings", { "aria-label": "Warnings" });

  function show() {
    const { warnings, numerics } = watch.job;
    const found = [...warnings.map(warning), ...(numerics ? problems(numerics) : [])];
    list.hidden = found.length === 0;
    list.replaceChildren(...found);
  }

  watch.on("job", show);
  show();
  drawer.panels.render.append(list);
}

/** @param {ProblemEntry} found */
function warning({ pointer, detail }) {
  return h("li", detail, " ", h("code.small.soft", inScene(pointer) || "/"));
}

/** @param {NonNullable<JobDocument["numerics"]>} numerics */
const problems = (numerics) =>
  NUMERICS.filter(([name]) => numerics[name] > 0).map(([name, noun, what]) =>
    h("li", `${plural(numerics[name], noun)} ${what}.`),
  );
