// All jobs, newest first, with filters, actions, and a choice of two to compare.

import { get, jobPath, messageOf, request } from "../api.js";
import { confirmed } from "../dialog.js";
import { announce, debounced, h, pause } from "../dom.js";
import { plural } from "../format.js";
import { navigate } from "../navigation.js";
import { cancel } from "./job/cancel.js";
import { NAMES, nameOf, stateName } from "./job/state.js";
import { skeleton } from "../elements.js";
import { labelsOf, makeRow } from "./jobs/row.js";

export const title = "Jobs";

const PAGE = 20;
// The most jobs that the service puts on a page.
const MOST = 100;
// The newest jobs are fetched again this often while one is queued or running, and all that are shown this often.
const BUSY_MS = 1500;
const CALM_MS = 10000;
const TYPING_MS = 300;
// The service filters by a whole label, name:value; the page filters by a part of one.
const WHOLE_LABEL = /^[A-Za-z0-9][A-Za-z0-9_.-]{0,62}:/;

/** @typedef {{state: string, label: string}} Filter Empty where there is none. */

/** @param {HTMLElement} root @param {ViewParams} params */
export function mount(root, { query }) {
  const life = new AbortController();
  const { signal } = life;
  /** @type {Map<string, import("./jobs/row.js").Row>} */
  const rows = new Map();
  const filter = { state: query.get("state") ?? "", label: query.get("label") ?? "" };
  /** @type {string | null} */
  let next = null;
  let pages = 1;
  /** @type {JobDocument[]} */
  let known = [];

  const list = h("ul", { className: "jobs" });
  const waiting = skeleton(5);
  const lead = h("p", { className: "lead", role: "status" });
  const trouble = h("p", { className: "problem", role: "alert", hidden: true });
  const more = h(
    "button",
    { type: "button", onclick: () => (pages++, reload()), hidden: true },
    "Older jobs",
  );
  const compare = h("button", { type: "button", disabled: true, onclick: openComparison }, "Compare two");
  /** @type {HTMLSelectElement} */
  const state = h(
    "select",
    { onchange: () => change("state", state.value) },
    h("option", { value: "" }, "all states"),
    NAMES.map((name) => h("option", { value: name }, stateName(name))),
  );
  const label = h("input", { type: "search", value: filter.label, autocomplete: "off" });
  state.value = filter.state;
  label.addEventListener(
    "input",
    debounced(TYPING_MS, () => change("label", label.value.trim()), signal),
  );

  /** @type {import("./jobs/row.js").Acts} */
  const acts = {
    onCancel: (job) => attempt(() => cancel(job)),
    onDelete: remove,
    onPick: picked,
    onLabel: (name) => ((label.value = name), change("label", name)),
  };

  /** @param {keyof Filter} name @param {string} value */
  function change(name, value) {
    filter[name] = value;
    pages = 1;
    const asked = new URLSearchParams(Object.entries(filter).filter(([, value]) => value));
    history.replaceState(null, "", asked.size ? `/jobs?${asked}` : "/jobs");
    reload();
  }

  async function reload({ newest = false } = {}) {
    try {
      known = newest ? await withNewest() : await fetchJobs();
      const jobs = known.filter((job) => fits(job, filter));
      show(jobs, jobs.some(isActive) || (await anyActive()));
      trouble.hidden = true;
    } catch (error) {
      if (signal.aborted) return;
      waiting.remove();
      trouble.textContent = messageOf(error);
      trouble.hidden = false;
    }
  }

  /** @param {number} limit @param {string | null} cursor @returns {Promise<JobListDocument>} */
  function fetchPage(limit, cursor) {
    const asked = new URLSearchParams({ limit: String(limit) });
    if (filter.state) asked.set("state", filter.state);
    if (WHOLE_LABEL.test(filter.label)) asked.set("label", filter.label);
    if (cursor) asked.set("cursor", cursor);
    return get(`/v1/jobs?${asked}`, { signal });
  }

  async function fetchJobs() {
    /** @type {JobDocument[]} */
    const jobs = [];
    /** @type {string | null} */
    let cursor = null;
    do {
      /** @type {JobListDocument} */
      const answer = await fetchPage(Math.min(MOST, PAGE * pages - jobs.length), cursor);
      jobs.push(...answer.jobs);
      cursor = answer.next;
    } while (cursor && jobs.length < PAGE * pages);
    next = cursor;
    return jobs;
  }

  /** The jobs that are shown, with the newest ones as they are now. */
  async function withNewest() {
    const { jobs } = await fetchPage(PAGE, null);
    const last = jobs.at(-1);
    if (!last) return [];
    const older = known.findIndex(({ id }) => id === last.id);
    return [
      ...jobs,
      ...(older < 0 ? known.filter(({ created_at: at }) => at < last.created_at) : known.slice(older + 1)),
    ];
  }

  /** Whether the service has an active job that the list does not show. */
  async function anyActive() {
    // Without a filter a list that has no older jobs shows all there are.
    if (!filter.state && !filter.label && next === null) return false;
    for (const state of ACTIVE) {
      /** @type {JobListDocument} */
      const { jobs } = await get(`/v1/jobs?state=${state}&limit=1`, { signal });
      if (jobs.length) return true;
    }
    return false;
  }

  /** @param {JobDocument[]} jobs @param {boolean} active - Whether any job is, also one that is not shown. */
  function show(jobs, active) {
    waiting.remove();
    const wanted = new Set(jobs.map(({ id }) => id));
    for (const [id, row] of rows) if (!wanted.has(id)) (row.element.remove(), rows.delete(id));
    jobs.forEach((job, place) => {
      const row = rows.get(job.id) ?? makeRow(job, acts);
      if (rows.has(job.id)) row.update(job);
      rows.set(job.id, row);
      if (list.children[place] !== row.element) list.insertBefore(row.element, list.children[place] ?? null);
    });
    more.hidden = next === null;
    lead.replaceChildren(...summary(jobs, filter, active));
    picked();
  }

  function picked() {
    const chosen = [...rows.values()].filter((row) => row.picked);
    compare.disabled = chosen.length !== 2;
    compare.textContent = chosen.length === 1 ? "Compare: choose another" : "Compare two";
  }

  function openComparison() {
    const chosen = [...rows.values()].filter((row) => row.picked);
    const [b, a] = [...list.children].flatMap(
      (element) => chosen.find((row) => row.element === element) ?? [],
    );
    navigate(`/compare/${a.id}/${b.id}`);
  }

  /** @param {JobDocument} job */
  async function remove(job) {
    const name = nameOf(job);
    if (!(await confirmed(`Delete ${name} and its picture?`, "Delete"))) return;
    await attempt(() => request(jobPath(job.id), { method: "DELETE" }));
    announce(`${name} was deleted.`);
  }

  /** @param {() => Promise<unknown>} action */
  async function attempt(action) {
    try {
      await action();
    } catch (error) {
      trouble.textContent = messageOf(error);
      trouble.hidden = false;
      return;
    }
    await reload();
  }

  async function follow() {
    let all = 0;
    while (!signal.aborted) {
      const newest = Date.now() < all + CALM_MS;
      if (!newest) all = Date.now();
      if (!document.hidden) await reload({ newest });
      await pause(known.some(isActive) ? BUSY_MS : CALM_MS, signal);
    }
  }

  root.append(
    h("h1", {}, "Jobs"),
    lead,
    h(
      "div",
      { className: "row filters" },
      h("label", { className: "field" }, h("span", { className: "label" }, "State"), state),
      h("label", { className: "field" }, h("span", { className: "label" }, "Label, as name:value"), label),
      compare,
    ),
    trouble,
    waiting,
    list,
    more,
  );
  follow();
  return () => life.abort();
}

// In the order in which the service is asked: where a job waits, another is usually being rendered.
const ACTIVE = ["running", "queued"];
/** @param {JobDocument} job */
const isActive = ({ state }) => ACTIVE.includes(state);

/** The filter that the service does not have: a part of a label. @param {JobDocument} job @param {Filter} filter */
function fits(job, { state, label }) {
  return (!state || job.state === state) && (!label || labelsOf(job).some((own) => own.includes(label)));
}

/** @param {JobDocument[]} jobs @param {Filter} filter @param {boolean} active */
function summary(jobs, filter, active) {
  const filtered = filter.state || filter.label;
  const shown = jobs.length ? "" : "No matching jobs. ";
  if (jobs.length || filtered) {
    const number = jobs.filter(isActive).length;
    if (!active) return [`${shown}No job is queued or running.`];
    return [
      number ? `${plural(number, "job")} queued or running.` : `${shown}Other jobs are queued or running.`,
    ];
  }
  return ["Nothing has been rendered yet. ", h("a", { href: "/" }, "Render a scene"), "."];
}
