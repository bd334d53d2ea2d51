// The table of jobs: searched, filtered and sorted by the service, many chosen at once.

import { get, messageOf } from "../api.js";
import { debounced, h, pause } from "../dom.js";
import { makeSelect, skeleton } from "../elements.js";
import { plural } from "../format.js";
import { amend } from "../navigation.js";
import { FINAL } from "../watch.js";
import { CHOICES, mayChange } from "./job/state.js";
import { makeChosen } from "./jobs/chosen.js";
import { COLUMNS, makeRow } from "./jobs/row.js";

export const title = "Jobs";

// As many as one screen shows, and as many as the service puts on a page.
const SCREEN = 20;
const PAGE = 100;
// The newest jobs are fetched again this often while one is queued or running, and all that are shown this often.
const BUSY_MS = 1500;
const CALM_MS = 10000;
const TYPING_MS = 300;
const SCROLLING_MS = 150;
const NEWEST_FIRST = "-created";

/** @typedef {Record<"state" | "label" | "search" | "sort", string>} Listing Empty where nothing is asked for. */
/** @typedef {{number: number, top: number}} Place How many jobs are shown, and how far the page is scrolled. */

/** @param {HTMLElement} root @param {ViewParams} params */
export function mount(root, { query, signal }) {
  /** @type {Map<string, import("./jobs/row.js").Row>} */
  const rows = new Map();
  /** @type {Listing} */
  const wanted = { state: "", label: "", search: "", sort: NEWEST_FIRST };
  for (const name of /** @type {(keyof Listing)[]} */ (Object.keys(wanted)))
    wanted[name] = query.get(name) ?? wanted[name];
  /** @type {Place | undefined} */
  let place = history.state?.jobs;
  let number = place?.number ?? SCREEN;
  /** @type {string | null} */
  let next = null;
  let total = 0;
  // An answer that others have overtaken is not shown.
  let reloads = 0;
  /** @type {JobDocument[]} */
  let known = [];
  /** @type {{user: string, role: string} | null} */
  let who = null;

  const isMine = (/** @type {JobDocument} */ job) => mayChange(who, job);
  const chosen = makeChosen(() => known.flatMap(({ id }) => rows.get(id) ?? []), isMine, attempt);
  /** @type {import("./jobs/row.js").Acts} */
  const acts = {
    mayChange: isMine,
    onCancel: chosen.cancel,
    onDelete: chosen.remove,
    onPick: chosen.pick,
    onLabel: (name) => change({ label: name }),
  };
  const body = h("tbody");
  const waiting = skeleton(5);
  const lead = h("p.lead", { role: "status" });
  const trouble = h("p.problem", { role: "alert" });
  const more = h("button", { onclick: showMore, hidden: true }, "More jobs");
  const heads = COLUMNS.map(([column, name, key]) =>
    h("th", { scope: "col", className: column }, key ? sorter(name, key) : name),
  );
  const table = h(
    "table.jobs",
    { hidden: true },
    h("thead", h("tr", h("td.pick", h("label", chosen.all)), h("td.thumbnail"), heads, h("td.act"))),
    body,
  );
  /** @type {HTMLSelectElement} */
  const state = makeSelect(
    { onchange: () => change({ state: state.value }) },
    [["", "all states"], ...CHOICES],
    wanted.state,
  );
  const search = h("input", { type: "search", value: wanted.search, autocomplete: "off" });
  search.addEventListener(
    "input",
    debounced(TYPING_MS, () => change({ search: search.value.trim() }), signal),
  );
  const label = h("button.label", { onclick: () => change({ label: "" }) });

  /** @param {Partial<Listing>} part */
  function change(part) {
    Object.assign(wanted, part);
    number = SCREEN;
    amend(Object.fromEntries(Object.entries(part).map(([name, value]) => [name, value || null])));
    remember();
    showOrder();
    reload();
  }

  /** @param {string} name @param {string} key */
  function sorter(name, key) {
    const sort = () => change({ sort: wanted.sort === key ? `-${key}` : key });
    return h("button.plain", { onclick: sort }, name);
  }

  function showOrder() {
    label.hidden = !wanted.label;
    label.textContent = `${wanted.label} ✕`;
    label.setAttribute("aria-label", `Show jobs with any label, not only ${wanted.label}`);
    COLUMNS.forEach(([, , key], i) => {
      if (key && wanted.sort.endsWith(key))
        heads[i].setAttribute("aria-sort", wanted.sort === key ? "ascending" : "descending");
      else heads[i].removeAttribute("aria-sort");
    });
  }

  function showMore() {
    number = (Math.floor(number / PAGE) + 1) * PAGE;
    remember();
    reload();
  }

  /** Keep the place in the history, for a return to it. */
  function remember() {
    history.replaceState({ ...history.state, jobs: { number, top: scrollY } }, "");
  }

  async function reload({ newest = false } = {}) {
    const current = ++reloads;
    try {
      who ??= await get("/v1/session", { signal });
      const jobs = await (newest ? withNewest() : fetchJobs());
      if (current !== reloads || signal.aborted) return;
      known = jobs;
      show();
      trouble.textContent = "";
    } catch (error) {
      if (current !== reloads || signal.aborted) return;
      waiting.remove();
      trouble.textContent = messageOf(error);
    }
  }

  /** @param {number} limit @param {string | null} cursor */
  async function fetchPage(limit, cursor) {
    const page = new URLSearchParams({ limit: String(limit) });
    for (const [name, value] of Object.entries({ ...wanted, cursor })) if (value) page.set(name, value);
    if (!cursor) page.set("total", "true");
    /** @type {JobListDocument} */
    const answer = await get(`/v1/jobs?${page}`, { signal });
    total = answer.total ?? total;
    return answer;
  }

  async function fetchJobs() {
    /** @type {Map<string, JobDocument>} */
    const jobs = new Map();
    /** @type {string | null} */
    let cursor = null;
    do {
      /** @type {JobListDocument} */
      const answer = await fetchPage(Math.min(PAGE, number - jobs.size), cursor);
      for (const job of answer.jobs) jobs.set(job.id, job);
      cursor = answer.next;
    } while (cursor && jobs.size < number);
    next = cursor;
    return [...jobs.values()];
  }

  /** The jobs that are shown, with the newest ones as they are now. */
  async function withNewest() {
    const { jobs } = await fetchPage(SCREEN, null);
    const oldest = jobs.at(-1);
    if (!oldest) return [];
    const older = known.findIndex(({ id }) => id === oldest.id);
    return [
      ...jobs,
      ...(older < 0 ? known.filter(({ created_at: at }) => at < oldest.created_at) : known.slice(older + 1)),
    ];
  }

  function show() {
    waiting.remove();
    const shown = new Set(known.map(({ id }) => id));
    for (const [id, row] of rows) if (!shown.has(id)) (row.element.remove(), rows.delete(id));
    known.forEach((job, i) => {
      const row = rows.get(job.id) ?? makeRow(job, acts);
      if (rows.has(job.id)) row.update(job);
      rows.set(job.id, row);
      if (body.children[i] !== row.element) body.insertBefore(row.element, body.children[i] ?? null);
    });
    table.hidden = !known.length;
    table.classList.toggle(
      "of-others",
      known.some(({ user }) => user !== who?.user),
    );
    more.hidden = next === null;
    lead.replaceChildren(...summary(total, wanted));
    chosen.show();
    if (place) scrollTo(0, place.top);
    place = undefined;
  }

  /** @param {() => Promise<unknown>} action */
  async function attempt(action) {
    const failure = await action().then(() => "", messageOf);
    await reload();
    if (failure) trouble.textContent = failure;
  }

  async function follow() {
    let whole = 0;
    while (!signal.aborted) {
      const newest = Date.now() < whole + CALM_MS && wanted.sort === NEWEST_FIRST;
      if (!newest) whole = Date.now();
      if (!document.hidden) await reload({ newest });
      await pause(known.some(({ state }) => !FINAL.has(state)) ? BUSY_MS : CALM_MS, signal);
    }
  }

  root.append(
    h("div.row.jobs-head", h("h1", "Jobs"), lead),
    h("div.row.filters", field("Name or label", search), field("State", state), label, chosen.element),
    trouble,
    waiting,
    table,
    more,
  );
  showOrder();
  addEventListener(
    "scroll",
    debounced(SCROLLING_MS, () => place || remember(), signal),
    { signal },
  );
  follow();
}

/** @param {string} name @param {HTMLElement} control */
const field = (name, control) => h("label.row", h("span.soft.small", name), control);

/** @param {number} total @param {Listing} wanted */
function summary(total, { state, label, search }) {
  if (state || label || search) return [total ? plural(total, "matching job") : "No matching jobs."];
  return total
    ? [plural(total, "job")]
    : ["Nothing has been rendered yet. ", h("a", { href: "/" }, "Render a scene"), "."];
}
