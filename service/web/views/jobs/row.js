// A job in the table. Updates change a row in place, so that it keeps the focus.

import { h } from "../../dom.js";
import { ago, codeValues, percent, qualityName, seconds } from "../../format.js";
import { FINAL } from "../../watch.js";
import { existedAlready, nameOf, standing, stateMark } from "../job/state.js";

/**
 * @typedef {object} Acts
 * @property {(job: JobDocument) => boolean} mayChange - Whether the user may cancel and delete it.
 * @property {(job: JobDocument) => void} onCancel
 * @property {(job: JobDocument) => void} onDelete
 * @property {(id: string, event: MouseEvent) => void} onPick
 * @property {(label: string) => void} onLabel
 * @typedef {ReturnType<typeof makeRow>} Row
 */

/** The headings of the columns, and what the service sorts some of them by. @type {[string, string, string?][]} */
export const COLUMNS = [
  ["name", "Name", "name"],
  ["standing", "State"],
  ["user", "User", "user"],
  ["size", "Size"],
  ["quality", "Quality"],
  ["error", "Error"],
  ["took", "Took"],
  ["created", "Submitted", "created"],
];

/** @param {JobDocument} first @param {Acts} acts */
export function makeRow(first, acts) {
  let job = first;
  const name = nameOf(first);
  const picture = h("img", { alt: "", loading: "lazy", width: 28, height: 28 });
  const pick = h("input", {
    type: "checkbox",
    onclick: (event) => acts.onPick(first.id, event),
    "aria-label": `Choose ${name}`,
  });
  const act = h("button.plain", { onclick: () => perform() });
  const link = h("a.name", { href: `/jobs/${first.id}`, title: name }, name);
  const labels = h("span.labels");
  const cells = COLUMNS.slice(1).map(([column]) => h("td", { className: column }));
  const element = h(
    "tr",
    h("td.pick", h("label", pick)),
    h("td.thumbnail", picture),
    h("th.name", { scope: "row" }, h("div.named", link, labels)),
    ...cells,
    h("td.act", act),
  );
  /** @type {string | null} */
  let shown = null;

  const perform = () => (FINAL.has(job.state) ? acts.onDelete : acts.onCancel)(job);

  /** @param {JobDocument} newest */
  function update(newest) {
    job = newest;
    labels.replaceChildren(
      ...Object.entries(job.labels ?? {}).map(([name, value]) => labelButton(name, value, acts.onLabel)),
    );
    valuesOf(job).forEach((value, i) => {
      cells[i].replaceChildren(value);
      cells[i].title = cells[i].textContent ?? "";
    });
    const verb = FINAL.has(job.state) ? "Delete" : "Cancel";
    act.textContent = verb;
    act.setAttribute("aria-label", `${verb} ${name}`);
    act.hidden = !acts.mayChange(job);
    show(hasPicture(job) ? `${job.links.image_png}?after=${job.last_seq}&width=` : null);
  }

  /** @param {string | null} version - Address of the picture, without its width. */
  function show(version) {
    if (version === shown) return;
    shown = version;
    if (version) Object.assign(picture, { srcset: `${version}192 2x`, src: `${version}96` });
    else for (const name of ["src", "srcset"]) picture.removeAttribute(name);
  }

  update(first);
  return {
    element,
    update,
    pick,
    get job() {
      return job;
    },
  };
}

/** @param {JobDocument} job */
const hasPicture = ({ last_seq: seq, state }) =>
  seq > 0 && !["failed", "cancelled", "expired"].includes(state);

/** @param {string} name @param {string} value - May be empty. @param {(label: string) => void} onLabel */
function labelButton(name, value, onLabel) {
  const text = value ? `${name}:${value}` : name;
  // The service's filter has the colon always.
  const onclick = () => onLabel(`${name}:${value}`);
  return h("button.label", { "aria-label": `Show only jobs with the label ${text}`, onclick }, text);
}

/** What the columns after the name show. @param {JobDocument} job @returns {(string | Node)[]} */
function valuesOf(job) {
  return [
    h("span", stateMark(standing(job)), ahead(job)),
    job.user,
    `${job.width} × ${job.height}`,
    job.damage ?? job.failure?.message ?? qualityName(job.quality),
    job.error ? `${codeValues(job.error.estimate)} / 255` : "",
    took(job),
    ago(job.created_at),
  ];
}

/** @param {JobDocument} job */
function ahead({ state, progress, queue_position: position }) {
  if (state === "running") return ` ${percent(progress.share)}`;
  if (state !== "queued" || position === null) return "";
  return position ? `, ${position} ahead` : ", next";
}

/** @param {JobDocument} job */
function took(job) {
  if (existedAlready(job)) return "existed already";
  return job.finished_at && job.run_seconds !== null ? seconds(job.run_seconds) : "";
}
