// The jobs that are chosen in the table, and what can be done with them.

import { jobPath, post, request } from "../../api.js";
import { confirmed } from "../../dialog.js";
import { announce, h } from "../../dom.js";
import { plural } from "../../format.js";
import { navigate } from "../../navigation.js";
import { FINAL } from "../../watch.js";
import { cancel } from "../job/cancel.js";
import { nameOf } from "../job/state.js";

/**
 * @param {() => import("./row.js").Row[]} rows - In the order of the table.
 * @param {(job: JobDocument) => boolean} mayChange - Whether the user may cancel and delete a job.
 * @param {(action: () => Promise<unknown>) => Promise<void>} attempt - Reports a failure, and shows the jobs again.
 */
export function makeChosen(rows, mayChange, attempt) {
  let last = "";
  const all = h("input", { type: "checkbox", onchange: pickAll, "aria-label": "Choose all jobs shown" });
  const compare = h("button", { onclick: openComparison }, "Compare");
  const stop = h("button", { onclick: () => cancelAll(open()) });
  const delete_ = h("button", { onclick: () => removeAll(changeable()) });
  const element = h("div.row.chosen", { role: "group", "aria-label": "Chosen jobs" }, compare, stop, delete_);

  const chosen = () => rows().flatMap(({ pick, job }) => (pick.checked ? [job] : []));
  const changeable = () => chosen().filter(mayChange);
  const open = () => changeable().filter(({ state }) => !FINAL.has(state));

  function show() {
    const jobs = chosen();
    all.checked = jobs.length > 0 && jobs.length === rows().length;
    all.indeterminate = jobs.length > 0 && !all.checked;
    compare.disabled = jobs.length !== 2 || jobs.some(({ state }) => state !== "succeeded");
    label(stop, "Cancel", open().length);
    label(delete_, "Delete", changeable().length);
  }

  /** Choose a job, or with Shift all from the last one on. @param {string} id @param {MouseEvent} event */
  function pick(id, event) {
    const order = rows();
    const [at, before] = [id, last].map((one) => order.findIndex(({ job }) => job.id === one));
    if (event.shiftKey && before >= 0)
      for (const row of order.slice(Math.min(at, before), Math.max(at, before) + 1))
        row.pick.checked = order[at].pick.checked;
    last = id;
    show();
  }

  function pickAll() {
    for (const { pick } of rows()) pick.checked = all.checked;
    show();
  }

  function openComparison() {
    // The older one is A, whatever the table is sorted by.
    const [a, b] = chosen().sort((a, b) => Date.parse(a.created_at) - Date.parse(b.created_at));
    navigate(`/compare/${a.id}/${b.id}`);
  }

  /** @param {JobDocument[]} jobs */
  async function cancelAll(jobs) {
    if (jobs.length === 1) return attempt(() => cancel(jobs[0]));
    const question = `Cancel ${plural(jobs.length, "job")}? What has been rendered is lost.`;
    if (await confirmed(question, "Cancel them"))
      await attempt(() => eachOf(jobs, (job) => post(job.links.cancel, {})));
  }

  /** @param {JobDocument[]} jobs */
  async function removeAll(jobs) {
    const one = jobs.length === 1;
    const what = one ? nameOf(jobs[0]) : plural(jobs.length, "job");
    if (!(await confirmed(`Delete ${what} and ${one ? "its picture" : "their pictures"}?`, "Delete"))) return;
    await attempt(async () => {
      await eachOf(jobs, (job) => request(jobPath(job.id), { method: "DELETE" }));
      announce(`${what} ${one ? "was" : "were"} deleted.`);
    });
  }

  show();
  return {
    element,
    all,
    pick,
    show,
    cancel: (/** @type {JobDocument} */ job) => cancelAll([job]),
    remove: (/** @type {JobDocument} */ job) => removeAll([job]),
  };
}

/** @param {HTMLButtonElement} button @param {string} verb @param {number} count */
function label(button, verb, count) {
  button.disabled = !count;
  button.textContent = count ? `${verb} ${count}` : verb;
}

/**
 * Do something with each job, one after another: a request holds a job until no part of it runs.
 *
 * @param {JobDocument[]} jobs
 * @param {(job: JobDocument) => Promise<unknown>} action
 */
async function eachOf(jobs, action) {
  for (const job of jobs) await action(job);
}
