// What can be done with a job: change it, download its picture, delete it.

import { get, jobPath, messageOf, post, request } from "../../api.js";
import { confirmed } from "../../dialog.js";
import { h } from "../../dom.js";
import { makeList } from "../../elements.js";
import { navigate } from "../../navigation.js";
import { makePopover } from "../picture/popover.js";
import { cancel } from "./cancel.js";
import { mayChange, nameOf } from "./state.js";

/** @import { Frame } from "../picture/frame.js" @import { Watch } from "../../watch.js" */

/** @param {Frame} frame @param {Watch} watch */
export function mount({ drawer }, watch) {
  const { job } = watch;
  /** @type {{user: string, role: string} | null} */
  let who = null;
  const trouble = h("p.problem", { role: "alert" });
  const act = (/** @type {() => Promise<unknown>} */ action) => async () => {
    trouble.textContent = "";
    try {
      await action();
      watch.refresh();
    } catch (error) {
      trouble.textContent = messageOf(error);
    }
  };
  const button = (/** @type {string} */ label, /** @type {() => Promise<unknown>} */ action) =>
    h("button", { onclick: act(action) }, label);
  const hold = button("Pause", () => post(watch.job.paused ? job.links.resume : job.links.pause, {}));
  const stop = button("Cancel", () => cancel(watch.job));
  const remove = button("Delete", removed);
  const again = h("a.button", { href: `/?job=${watch.id}` }, "Change and render again");
  const files = makePopover("Download", "downloads", downloads(job));

  async function removed() {
    if (!(await confirmed(`Delete ${nameOf(job)} and its picture?`, "Delete"))) return;
    await request(jobPath(watch.id), { method: "DELETE" });
    navigate("/jobs");
  }

  function show() {
    const { state, paused } = watch.job;
    const mine = mayChange(who, job);
    stop.hidden = hold.hidden = watch.final || !mine;
    hold.textContent = paused ? "Resume" : "Pause";
    // Only a finished job keeps its picture.
    files.button.hidden = watch.final && state !== "succeeded";
    again.hidden = state === "deleted";
    remove.hidden = again.hidden || !mine;
  }
  watch.on("job", show);
  show();
  get("/v1/session", { signal: watch.signal }).then(
    (session) => {
      who = session;
      show();
    },
    // The watch tells that the service does not answer.
    () => {},
  );
  drawer.panels.render.querySelector(".hero")?.append(h("div.row.hero-acts", hold, stop));
  drawer.panels.render.append(h("div.row.acts", again, files.button, remove), files.panel, trouble);
}

// Letters that file systems or shells take for something else.
const NOT_IN_NAMES = /[\\/:*?"<>|\p{Cc}]+/gu;

/** @param {JobDocument} job */
function downloads(job) {
  const { links } = job;
  const name = nameOf(job).replaceAll(NOT_IN_NAMES, "-");
  /** @type {[string, string, string][]} */
  const files = [
    ["PNG", links.image_png, "as displayed"],
    ["NPY", links.image_npy, "linear, for NumPy"],
    ["EXR", links.image_exr, "linear, with layers"],
  ];
  const there = files.filter(([, path]) => path);
  return makeList("ul.files", there, ([kind, path, what]) => [
    h("a", { href: path, download: `${name}.${kind.toLowerCase()}` }, kind),
    h("span.soft.small", ` ${what}`),
  ]);
}
