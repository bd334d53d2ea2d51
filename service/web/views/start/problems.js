// The list of problems below the editor; a click on one selects its place in the text.

import { h } from "../../dom.js";
import { plural } from "../../format.js";

/** @import { Checked } from "./validation.js" */

/** @param {string} id @param {(problem: ProblemEntry) => void} onPoint */
export function makeProblems(id, onPoint) {
  const summary = h("p", { className: "problems-summary", id, role: "status", "aria-live": "polite" });
  const list = h("ul", { className: "problems" });

  /** @param {Pick<Checked, "problems" | "more" | "warnings" | "failure" | "plan">} found */
  function show({ problems, more, warnings, failure, plan }) {
    list.replaceChildren(...[...problems, ...warnings].map((problem) => h("li", {}, entry(problem))));
    if (more) list.append(h("li", { className: "soft" }, `and ${more} more`));
    const bad = failure || problems.length;
    summary.className = `problems-summary ${bad ? "bad" : warnings.length ? "warned" : "good"}`;
    summary.textContent = failure ? failure.message : sentence(problems, more, warnings, plan);
  }

  /** @param {ProblemEntry} problem */
  function entry(problem) {
    const place = problem.line
      ? `Line ${problem.line}`
      : problem.pointer.startsWith("quality")
        ? "Quality"
        : "Scene";
    const text = [h("span", { className: "place" }, place), h("span", {}, problem.detail)];
    return problem.line || place === "Quality"
      ? h("button", { type: "button", className: "plain", onclick: () => onPoint(problem) }, text)
      : h("div", { className: "plain" }, text);
  }

  return {
    element: h("div", { className: "strip" }, summary, list),
    show,
    wait: () => {
      summary.className = "problems-summary soft";
      summary.textContent = "Checking …";
    },
  };
}

/** @param {ProblemEntry[]} problems @param {number} more @param {ProblemEntry[]} warnings @param {PlanDocument | null} plan */
function sentence(problems, more, warnings, plan) {
  const count = problems.length + more;
  if (count) return `${plural(count, "problem")} found.`;
  if (!plan) return "";
  const stages = `${plural(plan.stages.length, "stage")} will run`;
  return warnings.length
    ? `The scene is valid, with ${plural(warnings.length, "warning")}: ${stages}.`
    : `The scene is valid: ${stages}.`;
}
