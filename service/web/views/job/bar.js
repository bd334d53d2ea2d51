// The state and the progress of a job in the toolbar of its viewer.

import { h } from "../../dom.js";
import { percent, seconds } from "../../format.js";
import { standing, stateMark } from "./state.js";

/** @param {import("../picture/frame.js").Frame} frame @param {import("../../watch.js").Watch} watch */
export function mount({ bar, state }, watch) {
  const line = h("progress", { className: "bar-line", max: 1, "aria-label": "Progress" });
  bar.append(line);

  let isWhole = false;
  // Its place stays.
  const settle = () => line.classList.toggle("done", watch.final && isWhole);

  /** @param {JobDocument} job */
  function show(job) {
    const rest = h("span", { className: "bar-rest number" }, remark(job));
    state.replaceChildren(h("div", { className: "job-progress" }, stateMark(standing(job)), rest));
    line.value = job.progress.share;
    settle();
  }
  watch.on("job", show);
  watch.on("received", (share) => {
    isWhole = share === 1;
    if (watch.final) line.value = share;
    settle();
  });
  show(watch.job);
  return () => {};
}

/** @param {JobDocument} job */
function remark(job) {
  if (standing(job) !== "running") return "";
  const left = job.progress.remaining_seconds;
  return left === null
    ? percent(job.progress.share)
    : `${percent(job.progress.share)}, ${seconds(left)} left`;
}
