// One job in the list. Updates change a row in place, so that it keeps the focus.

import { h } from "../../dom.js";
import { ago, codeValues, percent, plural, qualityName, seconds } from "../../format.js";
import { FINAL } from "../../watch.js";
import { existedAlready, nameOf, standing, stateMark } from "../job/state.js";

/**
 * @typedef {object} Acts
 * @property {(job: JobDocument) => void} onCancel
 * @property {(job: JobDocument) => void} onDelete
 * @property {() => void} onPick
 * @property {(label: string) => void} onLabel
 * @typedef {ReturnType<typeof makeRow>} Row
 */

/** @param {JobDocument} first @param {Acts} acts */
export function makeRow(first, acts) {
  let job = first;
  const name = nameOf(first);
  const picture = h("img", { alt: "", loading: "lazy", width: 96, height: 96 });
  const thumbnail = h(
    "a",
    { className: "thumbnail", href: `/jobs/${first.id}`, tabIndex: -1, "aria-hidden": "true" },
    picture,
  );
  const state = h("span");
  const facts = h("p", { className: "soft small" });
  const labels = h("span", { className: "labels" });
  const pick = h("input", {
    type: "checkbox",
    onchange: acts.onPick,
    "aria-label": `Choose ${name} for a comparison`,
  });
  const cancel = h(
    "button",
    { type: "button", "aria-label": `Cancel ${name}`, onclick: () => acts.onCancel(job) },
    "Cancel",
  );
  const remove = h(
    "button",
    { type: "button", "aria-label": `Delete ${name}`, onclick: () => acts.onDelete(job) },
    "Delete",
  );
  const link = h("a", { className: "name", href: `/jobs/${first.id}` }, name);
  const element = h(
    "li",
    { className: "job-row" },
    h("label", { className: "pick", title: "Compare" }, pick),
    thumbnail,
    h("div", { className: "what" }, h("div", { className: "row" }, link, state, labels), facts),
    h("div", { className: "row acts" }, cancel, remove),
  );
  /** @type {string | null} */
  let shown = null;

  /** @param {JobDocument} newest */
  function update(newest) {
    job = newest;
    state.replaceChildren(stateMark(standing(job)));
    facts.textContent = factsOf(job);
    labels.replaceChildren(...labelsOf(job).map((label) => labelButton(label, acts.onLabel)));
    cancel.hidden = FINAL.has(job.state);
    pick.disabled = job.state !== "succeeded";
    const version =
      job.last_seq > 0 && !["failed", "cancelled", "expired"].includes(job.state)
        ? `${job.links.image_png}?after=${job.last_seq}&width=`
        : null;
    if (version !== shown) {
      shown = version;
      if (version) Object.assign(picture, { srcset: `${version}192 2x`, src: `${version}96` });
      else for (const name of ["src", "srcset"]) picture.removeAttribute(name);
      picture.hidden = !version;
    }
  }

  update(first);
  return {
    element,
    update,
    id: first.id,
    get picked() {
      return pick.checked && !pick.disabled;
    },
  };
}

/** @param {string} label @param {(label: string) => void} onLabel */
function labelButton(label, onLabel) {
  return h(
    "button",
    {
      type: "button",
      className: "label",
      "aria-label": `Show only jobs with the label ${label}`,
      onclick: () => onLabel(label),
    },
    label,
  );
}

/** The labels of a job, in the form of the service's filter. @param {JobDocument} job */
export function labelsOf({ labels = {} }) {
  return Object.entries(labels).map(([name, value]) => `${name}:${value}`);
}

/** @param {JobDocument} job */
function factsOf(job) {
  if (job.damage) return `${job.damage}  ·  ${ago(job.created_at)}`;
  const facts = [`${job.width} × ${job.height}`, qualityName(job.quality)];
  if (job.state === "running") facts.push(percent(job.progress.share));
  if (job.state === "queued" && job.queue_position !== null)
    facts.push(job.queue_position ? `${plural(job.queue_position, "job")} ahead` : "next");
  if (job.error) facts.push(`error ${codeValues(job.error.estimate)} code values`);
  if (existedAlready(job)) facts.push("existed already");
  else if (job.finished_at && job.started_at)
    facts.push(`took ${seconds((Date.parse(job.finished_at) - Date.parse(job.started_at)) / 1000)}`);
  if (job.failure) facts.push(job.failure.message);
  facts.push(ago(job.created_at));
  return facts.join("  ·  ");
}
