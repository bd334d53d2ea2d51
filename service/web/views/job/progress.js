// Progress of a job: the remaining time, rays, and the error with its interval.

import { announce, h } from "../../dom.js";
import { figure } from "../../elements.js";
import { ago, codeValues, count, cpuSeconds, percent, plural, qualityName, seconds } from "../../format.js";
import { existedAlready, standing, stateMark, stateName } from "./state.js";

/** @import { Frame } from "../picture/frame.js" @import { Watch } from "../../watch.js" */

/** @param {Frame} frame @param {Watch} watch */
export function mount(frame, watch) {
  const large = h("p.hero-time");
  const small = h("p.soft.small");
  const list = h("dl.figures");
  const trouble = h("div.problem", { role: "alert" });
  frame.drawer.panels.render.append(h("h2.unseen", "Progress"), h("div.hero", large, small), trouble, list);
  /** @type {string | null} */
  let state = null;

  /** @param {JobDocument} job */
  function show(job) {
    const [time, ...rest] = headline(job);
    large.textContent = time;
    small.replaceChildren(...rest.map((line) => h("span", line || "\u00a0")));
    list.replaceChildren(...figures(job));
    trouble.textContent = job.damage ?? job.failure?.message ?? "";
    if (state !== null && state !== standing(job)) announce(`The job is ${stateName(standing(job))}.`);
    state = standing(job);
  }

  watch.on("job", show);
  show(watch.job);
  mountBar(frame, watch);
}

/** The large line, and two small ones below it. @param {JobDocument} job */
function headline(job) {
  // Little else is known of it.
  if (job.damage) return [sentence(stateName(job.state)), "", ""];
  const left = job.progress.remaining_seconds;
  const spent = job.run_seconds === null ? "" : seconds(job.run_seconds);
  switch (standing(job)) {
    case "queued":
      return ["Queued", job.queue_position ? `${plural(job.queue_position, "job")} ahead` : "next", ""];
    case "running":
      return [
        left === null ? "Rendering" : `${seconds(left)} left`,
        stepsOf(job),
        spent && `${spent} so far`,
      ];
    case "paused":
      return ["Paused", stepsOf(job), spent && `${spent} so far`];
    case "succeeded":
      if (existedAlready(job)) return ["Existed already", "rendered for an equal job before", stepsOf(job)];
      return [`Done in ${spent}`, "from start to finish", stepsOf(job)];
    default:
      return [sentence(stateName(job.state)), spent ? `after ${spent}` : "before it began", stepsOf(job)];
  }
}

/** @param {string} word */
const sentence = (word) => word[0].toUpperCase() + word.slice(1);

// With a target error each pass depends on the one before, so the number of steps is not known in advance.
/** @param {JobDocument} job */
function stepsOf(job) {
  const { done, total } = job.progress;
  return job.quality.mode === "target" || done === total
    ? `${plural(done, "step")} done`
    : `${count(done)} of ${count(total)} steps`;
}

/** @param {JobDocument} job */
function figures(job) {
  if (job.damage) return [];
  const rays = Object.entries(job.cost.rays).filter(([, number]) => number > 0);
  const all = rays.reduce((sum, [, number]) => sum + number, 0);
  // All of them from the start, so that nothing moves when one becomes known.
  return [
    figure(
      "CPU time",
      cpuSeconds(job.cost.cpu_seconds),
      `${cpuSeconds(job.cost.predicted_cpu_seconds)} predicted`,
    ),
    figure(
      "Rays",
      all ? count(all) : "–",
      rays.map(([kind, number]) => `${count(number)} ${kind}`).join(", "),
    ),
    figure("Error", ...errorOf(job)),
    figure("Picture", `${job.width} × ${job.height}`, qualityName(job.quality)),
    figure("Job", h("code", job.id), `submitted ${ago(job.created_at)}`),
  ];
}

/** @param {JobDocument} job @returns {[string, string]} */
export function errorOf({ error }) {
  if (!error) return ["–", "no estimate"];
  return [
    `${codeValues(error.estimate)} code values`,
    `95\u00a0% interval ${codeValues(error.low)} to ${codeValues(error.high)}`,
  ];
}

/** State and progress in the toolbar of the viewer. @param {Frame} frame @param {Watch} watch */
function mountBar({ bar, state }, watch) {
  const line = h("progress.bar-line", { max: 1, "aria-label": "Progress" });
  bar.append(line);

  let isWhole = false;
  // Its place stays.
  const settle = () => line.classList.toggle("done", watch.final && isWhole);

  /** @param {JobDocument} job */
  function show(job) {
    const rest = h("span.bar-rest.number", remark(job));
    state.replaceChildren(h("div.job-progress", stateMark(standing(job)), rest));
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
}

/** @param {JobDocument} job */
function remark(job) {
  if (standing(job) !== "running") return "";
  const left = job.progress.remaining_seconds;
  return left === null
    ? percent(job.progress.share)
    : `${percent(job.progress.share)}, ${seconds(left)} left`;
}
