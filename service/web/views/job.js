// The page of a job. Its panels share one watch.

import { get, jobPath, post, request } from "../api.js";
import { confirmed } from "../dialog.js";
import { h } from "../dom.js";
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

export function mount(root, { id }) {
  const life = new AbortController();
  const unmounts = [];
  open(root, id, life.signal, unmounts).catch((error) => {
    if (!life.signal.aborted)
      root.replaceChildren(
        h("h1", {}, "This job cannot be shown"),
        h("p", { className: "lead" }, error.message),
      );
  });
  return () => {
    life.abort();
    for (const unmount of unmounts.splice(0)) unmount();
  };
}

async function open(root, id, signal, unmounts) {
  const job = await get(jobPath(id), { signal });
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

  const report = (text) => ((notice.textContent = text), (notice.hidden = !text));
  function show() {
    cancel.hidden = hold.hidden = watch.final;
    hold.textContent = watch.job.paused ? "Resume" : "Pause";
  }
  watch.on("job", show);
  watch.on("connection", (live) => report(live ? "" : "The service does not answer. Trying again …"));
  watch.on("gone", () => report("This job was deleted."));
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
    h("div", { className: "row" }, hold, cancel, again, downloads(job), remove),
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
