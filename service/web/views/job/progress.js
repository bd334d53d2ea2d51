// Progress of a job: state, share, time, rays, and the error with its interval.

import { announce, h } from "../../dom.js";
import { codeValues, count, cpuSeconds, percent, plural, qualityName, seconds } from "../../format.js";
import { standing, stateMark, stateName } from "./state.js";

const TICK_MS = 1000;

export function mount(root, watch) {
  const bar = h("progress", { max: 1, "aria-label": "Progress" });
  const share = h("span", { className: "share" });
  const line = h("div", { className: "progress-line" });
  const list = h("dl", { className: "figures" });
  const trouble = h("div", { className: "problem", role: "alert", hidden: true });
  root.append(
    h("h2", { className: "unseen" }, "Progress"),
    line,
    h("div", { className: "bar" }, bar, share),
    list,
    trouble,
  );
  let state = null;

  function show(job) {
    line.replaceChildren(stateMark(standing(job)), h("span", { className: "soft" }, remark(job)));
    bar.value = job.progress.share;
    share.textContent = percent(job.progress.share);
    list.replaceChildren(...figures(job));
    trouble.textContent = job.damage ?? job.failure?.message ?? "";
    trouble.hidden = !trouble.textContent;
    if (state !== null && state !== standing(job)) announce(`The job is ${stateName(standing(job))}.`);
    state = standing(job);
  }

  watch.on("job", show);
  show(watch.job);
  // Between two updates only the elapsed time changes.
  const timer = setInterval(() => standing(watch.job) === "running" && show(watch.job), TICK_MS);
  return () => clearInterval(timer);
}

function remark(job) {
  if (job.state === "queued" && !job.paused)
    return job.queue_position ? `${job.queue_position} ahead of it` : "next";
  if (job.state === "running" && job.progress.total > 1)
    return [stepsOf(job), left(job)].filter(Boolean).join(", ");
  return "";
}

// With a target error each pass depends on the one before, so the number of steps is not known in advance.
function stepsOf(job) {
  const { done, total } = job.progress;
  return job.quality.mode === "target"
    ? `${plural(done, "step")} done`
    : `${count(done)} of ${count(total)} steps`;
}

function left(job) {
  return job.progress.remaining_seconds === null
    ? ""
    : `about ${seconds(job.progress.remaining_seconds)} left`;
}

function figures(job) {
  if (job.damage) return [];
  const rays = Object.entries(job.cost.rays).filter(([, number]) => number > 0);
  const all = rays.reduce((sum, [, number]) => sum + number, 0);
  const took = elapsed(job);
  return [
    took === null
      ? null
      : figure(
          "Time",
          seconds(took),
          `${cpuSeconds(job.cost.cpu_seconds)}, ${cpuSeconds(job.cost.predicted_cpu_seconds)} predicted`,
        ),
    all
      ? figure("Rays", count(all), rays.map(([kind, number]) => `${count(number)} ${kind}`).join(", "))
      : null,
    job.error
      ? figure(
          "Error",
          `${codeValues(job.error.estimate)} code values`,
          `95 % interval ${codeValues(job.error.low)} to ${codeValues(job.error.high)}, in units of 1/255`,
        )
      : null,
    figure("Picture", `${job.width} × ${job.height}`, qualityName(job.quality)),
  ].filter(Boolean);
}

function elapsed(job) {
  if (!job.started_at) return null;
  return Math.max(
    0,
    (Date.parse(job.finished_at ?? new Date().toISOString()) - Date.parse(job.started_at)) / 1000,
  );
}

function figure(name, value, rest) {
  return h(
    "div",
    {},
    h("dt", {}, name),
    h("dd", {}, h("strong", {}, value), rest ? h("span", { className: "soft small" }, rest) : null),
  );
}
