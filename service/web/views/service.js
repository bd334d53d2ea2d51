// For admins: what each worker is at, and what each user uses.

import { get, messageOf, Problem } from "../api.js";
import { h, pause } from "../dom.js";
import { ago, bytes, count, cpuSeconds, plural, seconds } from "../format.js";

export const title = "Service";

const WORKERS_MS = 2000;
// Users are counted in the database: less often than workers, which are in memory.
const USERS_MS = 30000;

/** @param {HTMLElement} root */
export function mount(root) {
  const life = new AbortController();
  const lead = h("p", { className: "lead", role: "status" });
  const trouble = h("p", { className: "problem", role: "alert", hidden: true });
  const workers = h("tbody");
  const users = h("tbody");

  /** Ask again and again until the view is left. @param {() => Promise<void>} ask @param {number} wait */
  async function repeat(ask, wait) {
    while (!life.signal.aborted) {
      try {
        await ask();
        trouble.hidden = true;
      } catch (error) {
        if (life.signal.aborted) return;
        trouble.textContent = messageOf(error);
        trouble.hidden = false;
        // Whoever is no admin will not become one.
        if (error instanceof Problem && error.status === 403) return;
      }
      await pause(wait, life.signal);
    }
  }

  async function showWorkers() {
    /** @type {WorkerListDocument} */
    const found = await get("/v1/workers", life);
    const busy = found.workers.filter(({ task }) => task).length;
    lead.textContent = `${count(busy)} of ${plural(found.workers.length, "worker")} busy on ${found.server}.`;
    show(workers, found.workers.map(worker));
  }

  async function showUsers() {
    /** @type {UserDocument[]} */
    const known = [];
    /** @type {string | null} */
    let cursor = null;
    do {
      const asked = new URLSearchParams({ limit: "1000", ...(cursor && { cursor }) });
      /** @type {UserListDocument} */
      const page = await get(`/v1/users?${asked}`, life);
      known.push(...page.users);
      cursor = page.next;
    } while (cursor);
    show(users, known.map(user));
  }

  root.append(
    h("h1", {}, title),
    lead,
    trouble,
    section("Workers", ["Worker", "Process", "Memory", "Task", "For", "Users", "Jobs"], workers),
    section("Users", ["User", "Open jobs", "Stored", "CPU time", "Key last used"], users),
  );
  repeat(showWorkers, WORKERS_MS);
  repeat(showUsers, USERS_MS);
  return () => life.abort();
}

/** Replace the rows of a table, which is shown with the first ones. @param {HTMLElement} body @param {Node[]} rows */
function show(body, rows) {
  body.replaceChildren(...rows);
  const section = body.closest("section");
  if (section) section.hidden = false;
}

/** @param {string} name @param {string[]} headings @param {HTMLElement} body */
function section(name, headings, body) {
  const head = h(
    "thead",
    {},
    h(
      "tr",
      {},
      headings.map((heading) => h("th", { scope: "col" }, heading)),
    ),
  );
  // A region that scrolls must be reachable by the keyboard.
  return h(
    "section",
    { className: "use", tabIndex: 0, "aria-label": name, hidden: true },
    h("h2", {}, name),
    h("table", {}, head, body),
  );
}

/** @param {(string | Node | Node[])[]} cells */
const row = ([first, ...cells]) =>
  h(
    "tr",
    {},
    h("th", { scope: "row" }, first),
    cells.map((cell) => h("td", {}, cell)),
  );

/** @param {WorkerDocument} worker */
function worker({ name, pid, memory_bytes: memory, task, seconds: passed, users, jobs }) {
  const links = jobs.flatMap((id) => [h("a", { href: `/jobs/${encodeURIComponent(id)}` }, id), " "]);
  return row([
    name,
    pid === null ? "" : String(pid),
    memory === null ? "" : bytes(memory),
    task ?? "idle",
    task ? seconds(passed) : "",
    users.join(", "),
    h("span", {}, links),
  ]);
}

/** @param {UserDocument} user */
function user({ user: name, open_jobs: open, stored_bytes: stored, cpu_seconds: cpu, last_used_at: used }) {
  return row([name, count(open), bytes(stored), cpuSeconds(cpu), used ? ago(used) : ""]);
}
