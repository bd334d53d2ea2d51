// The page of a job. Its panels share one watch.

import { Problem, get, jobPath, post, request } from "../api.js";
import { confirmed } from "../dialog.js";
import { h, pause } from "../dom.js";
import { ago } from "../format.js";
import { navigate } from "../navigation.js";
import { Watch } from "../watch.js";
import * as convergence from "./job/convergence.js";
import * as plan from "./job/plan.js";
import * as progress from "./job/progress.js";
import * as picture from "./picture/panel.js";

export const title = "Job";

// Each has mount(root, watch) -> unmount(), and receives no events once watch.signal is aborted.
const PANELS = [
  ["picture", "Picture", picture],
  ["progress", "Progress", progress],
  ["convergence", "Accuracy against time", convergence],
  ["understand", "Plan", plan],
];

// Milliseconds before a service that does not answer is asked for the job again.
const RETRY_MS = 2000;

export function mount(root, { id }) {
  const life = new AbortController();
  const unmounts = [];
  open(root, id, life.signal, unmounts).catch((error) => !life.signal.aborted && refuse(root, error));
  return () => {
    life.abort();
    for (const unmount of unmounts.splice(0)) unmount();
  };
}

function refuse(root, error) {
  const refused = error.status === 401 || error.status === 403;
  root.replaceChildren(
    h("h1", {}, "This job cannot be shown"),
    h("p", { className: "lead" }, error.message),
    refused ? signIn() : "",
  );
}

/** Opens this page again; the first request asks for a key. */
function signIn() {
  const again = () => navigate(location.pathname + location.search, { replace: true });
  return h("button", { type: "button", className: "primary", onclick: again }, "Sign in");
}

/** The job, as soon as the service answers. */
async function found(root, id, signal) {
  while (true) {
    try {
      return await get(jobPath(id), { signal });
    } catch (error) {
      if (signal.aborted || (error instanceof Problem && error.status < 500)) throw error;
      root.replaceChildren(h("p", { className: "lead", role: "status" }, `${error.message} Trying again …`));
      await pause(RETRY_MS, signal);
    }
  }
}

async function open(root, id, signal, unmounts) {
  const job = await found(root, id, signal);
  root.replaceChildren();
  const watch = new Watch(job);
  unmounts.push(() => watch.stop());
  document.title = `${nameOf(job)} · Penumbra`;
  root.append(heading(watch));
  const grid = h("div", { className: "job" });
  root.append(grid);
  for (const [name, label, panel] of PANELS) {
    const place = h("section", { className: `job-${name}`, "aria-label": label });
    grid.append(place);
    unmounts.push(panel.mount(place, watch));
  }
  watch.start();
}

const nameOf = (job) => job.name ?? "Untitled scene";

function heading(watch) {
  const { job } = watch;
  const notice = h("p", { className: "problem", role: "status", hidden: true });
  const cancel = h(
    "button",
    { type: "button", onclick: () => attempt(() => post(job.links.cancel, {})) },
    "Cancel",
  );
  const hold = h("button", {
    type: "button",
    onclick: () => attempt(() => post(watch.job.paused ? job.links.resume : job.links.pause, {})),
  });
  const remove = h("button", { type: "button", onclick: () => attempt(removed) }, "Delete");
  const again = h("a", { className: "button", href: `/?job=${watch.id}` }, "Change and render again");
  const files = downloads(job);

  async function attempt(action) {
    try {
      await action();
      watch.refresh();
    } catch (error) {
      report(error.message);
    }
  }

  async function removed() {
    if (!(await confirmed(`Delete ${nameOf(job)} and its picture?`, "Delete"))) return;
    await request(jobPath(watch.id), { method: "DELETE" });
    navigate("/jobs");
  }

  const report = (...content) => {
    notice.replaceChildren(...content);
    notice.hidden = !content.join("");
  };
  function show() {
    const { state, paused } = watch.job;
    cancel.hidden = hold.hidden = watch.final;
    hold.textContent = paused ? "Resume" : "Pause";
    // Only a finished job keeps its picture.
    files.hidden = watch.final && state !== "succeeded";
    remove.hidden = again.hidden = state === "deleted";
  }
  watch.on("job", show);
  watch.on("connection", (live) => report(live ? "" : "The service does not answer. Trying again …"));
  watch.on("gone", () => report("This job was deleted."));
  watch.on("locked", (error) => report(`${error.message} The page no longer follows this job. `, signIn()));
  show();
  return h(
    "header",
    { className: "job-head" },
    h(
      "div",
      {},
      h("h1", {}, nameOf(job)),
      h("p", { className: "soft small" }, `Submitted ${ago(job.created_at)} as `, h("code", {}, job.id)),
    ),
    h("div", { className: "row" }, hold, cancel, again, files, remove),
    notice,
  );
}

function downloads({ links }) {
  const files = [
    ["PNG", links.image_png, "as displayed"],
    ["NPY", links.image_npy, "linear, for NumPy"],
    ["EXR", links.image_exr, "linear, with layers"],
  ];
  const list = files
    .filter(([, path]) => path)
    .map(([name, path, what]) =>
      h(
        "li",
        {},
        h("a", { href: path, download: "" }, name),
        h("span", { className: "soft small" }, ` ${what}`),
      ),
    );
  return h(
    "details",
    { className: "menu" },
    h("summary", { className: "button" }, "Download"),
    h("ul", {}, list),
  );
}
