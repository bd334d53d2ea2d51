// For admins: what each worker is at, and what each user uses.

import { get, messageOf, Problem } from "../api.js";
import { h, pause } from "../dom.js";
import { makeTable } from "../elements.js";
import { ago, bytes, count, cpuSeconds, plural, seconds } from "../format.js";

export const title = "Service";

const WORKERS_MS = 2000;
// Users are counted in the database: less often than workers, which are in memory.
const USERS_MS = 30000;

/** @param {HTMLElement} root @param {ViewParams} params */
export function mount(root, { signal }) {
  const lead = h("p.lead", { role: "status" });
  const trouble = h("p.problem", { role: "alert" });
  const workers = makeSection("Workers", ["Worker", "Process", "Memory", "Task", "For", "Users", "Jobs"]);
  const users = makeSection("Users", ["User", "Open jobs", "Stored", "CPU time", "Key last used"]);

  /** Ask again and again until the view is left. @param {() => Promise<void>} ask @param {number} wait */
  async function repeat(ask, wait) {
    while (!signal.aborted) {
      try {
        await ask();
        trouble.textContent = "";
      } catch (error) {
        if (signal.aborted) return;
        trouble.textContent = messageOf(error);
        // Whoever is no admin will not become one.
        if (error instanceof Problem && error.status === 403) return;
      }
      await pause(wait, signal);
    }
  }

  async function showWorkers() {
    /** @type {WorkerListDocument} */
    const found = await get("/v1/workers", { signal });
    const busy = found.workers.filter(({ task }) => task).length;
    lead.textContent = `${count(busy)} of ${plural(found.workers.length, "worker")} busy on ${found.server}.`;
    workers.show(found.workers.map(worker));
  }

  async function showUsers() {
    /** @type {UserDocument[]} */
    const known = [];
    /** @type {string | null} */
    let cursor = null;
    do {
      const asked = new URLSearchParams({ limit: "1000", ...(cursor && { cursor }) });
      /** @type {UserListDocument} */
      const page = await get(`/v1/users?${asked}`, { signal });
      known.push(...page.users);
      cursor = page.next;
    } while (cursor);
    users.show(known.map(user));
  }

  root.append(h("h1", title), lead, trouble, workers.element, users.element);
  repeat(showWorkers, WORKERS_MS);
  repeat(showUsers, USERS_MS);
}

/** A table, which is shown with its first rows. @param {string} name @param {string[]} headings */
function makeSection(name, headings) {
  // A region that scrolls must be reachable by the keyboard.
  const element = h("section.use", { tabIndex: 0, "aria-label": name, hidden: true });
  /** @param {import("../elements.js").Cell[][]} rows */
  function show(rows) {
    element.replaceChildren(h("h2", name), makeTable("", headings, rows));
    element.hidden = false;
  }
  return { element, show };
}

/** @param {WorkerDocument} worker */
function worker({ name, pid, memory_bytes: memory, task, seconds: passed, users, jobs }) {
  const links = jobs.flatMap((id) => [h("a", { href: `/jobs/${encodeURIComponent(id)}` }, id), " "]);
  return [
    name,
    pid === null ? "" : String(pid),
    memory === null ? "" : bytes(memory),
    task ?? "idle",
    task ? seconds(passed) : "",
    users.join(", "),
    h("span", links),
  ];
}

/** @param {UserDocument} user */
function user({ user: name, open_jobs: open, stored_bytes: stored, cpu_seconds: cpu, last_used_at: used }) {
  return [name, count(open), bytes(stored), cpuSeconds(cpu), used ? ago(used) : ""];
}
