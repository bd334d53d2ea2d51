// The list of problems below the editor; a click on one selects its place in the text.

import { h } from "../../dom.js";
import { plural } from "../../format.js";

/** @param {(problem: object) => void} onPoint */
export function makeProblems(id, onPoint) {
  const summary = h("p", { className: "problems-summary", id, role: "status", "aria-live": "polite" });
  const list = h("ul", { className: "problems" });

  function show({ problems, more, failure, plan }) {
    list.replaceChildren(...problems.map((problem) => h("li", {}, entry(problem))));
    if (more) list.append(h("li", { className: "soft" }, `and ${more} more`));
    summary.className = failure || problems.length ? "problems-summary bad" : "problems-summary good";
    summary.textContent = failure ? failure.message : sentence(problems, more, plan);
  }

  function entry(problem) {
    const place = problem.line
      ? `Line ${problem.line}`
      : problem.pointer.startsWith("quality")
        ? "Quality"
        : "Scene";
    const text = [h("span", { className: "place" }, place), h("span", {}, problem.detail, hint(problem))];
    return problem.line
      ? h("button", { type: "button", className: "plain", onclick: () => onPoint(problem) }, text)
      : h("div", { className: "plain" }, text);
  }

  return {
    element: h("div", {}, summary, list),
    show,
    wait: () => {
      summary.className = "problems-summary soft";
      summary.textContent = "Checking …";
    },
  };
}

function hint({ suggestion, detail }) {
  return suggestion && !detail.includes(suggestion) ? ` Did you mean ${suggestion}?` : null;
}

function sentence(problems, more, plan) {
  const count = problems.length + more;
  if (count) return `${plural(count, "problem")} found.`;
  return plan ? `The scene is valid: ${plural(plan.stages.length, "stage")} will run.` : "";
}
