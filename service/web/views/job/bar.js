// The toolbar of the viewer: title, state, and places for the controls of the picture.

import { h } from "../../dom.js";
import { percent, seconds } from "../../format.js";
import { makeIcon } from "../picture/icons.js";
import { nameOf, standing, stateMark } from "./state.js";

/**
 * @param {import("../../watch.js").Watch} watch
 * @param {import("./drawer.js").Drawer} drawer
 * @returns {{element: HTMLElement, controls: HTMLElement}} Controls of the picture go into `controls`.
 */
export function makeBar(watch, drawer) {
  const name = nameOf(watch.job);
  const state = h("div", { className: "job-progress" });
  const line = h("progress", { className: "bar-line", max: 1, "aria-label": "Progress" });
  const controls = h("div", { className: "bar-controls", role: "group", "aria-label": "Display" });

  /** @param {JobDocument} job */
  function show(job) {
    const rest = h("span", { className: "bar-rest number" }, remark(job));
    state.replaceChildren(stateMark(standing(job)), rest);
    line.value = job.progress.share;
    // Its place stays.
    line.classList.toggle("done", watch.final);
  }
  watch.on("job", show);
  show(watch.job);

  const panel = h(
    "button",
    {
      type: "button",
      className: "icon",
      title: "Show or hide the panel",
      "aria-label": "Panel",
      "aria-expanded": "true",
      "aria-controls": drawer.element.id,
      onclick: () => drawer.toggle(),
    },
    makeIcon("panel"),
  );
  drawer.addEventListener("toggle", () => panel.setAttribute("aria-expanded", String(drawer.isOpen)));

  const element = h(
    "header",
    { className: "bar-top" },
    h("h1", { title: name }, name),
    state,
    controls,
    panel,
    line,
  );
  return { element, controls };
}

/** @param {JobDocument} job */
function remark(job) {
  if (standing(job) !== "running") return "";
  const left = job.progress.remaining_seconds;
  return left === null
    ? percent(job.progress.share)
    : `${percent(job.progress.share)}, ${seconds(left)} left`;
}
