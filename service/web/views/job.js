// The page of a job: a viewer that fills the window. Its parts share one watch.

import { Problem, get, jobPath, messageOf } from "../api.js";
import { h, pause } from "../dom.js";
import { signInButton } from "../session.js";
import { Watch } from "../watch.js";
import * as actions from "./job/actions.js";
import * as convergence from "./job/convergence.js";
import * as picture from "./job/picture.js";
import * as plan from "./job/plan.js";
import * as progress from "./job/progress.js";
import { nameOf, tabTitle } from "./job/state.js";
import * as warnings from "./job/warnings.js";
import { makeFrame, refuse } from "./picture/frame.js";

export const title = "Job";

/** @import { Frame } from "./picture/frame.js" */

// In the order of the drawer. What they hear ends with the watch; what else is to be ended, with the view.
/** @type {{mount: (frame: Frame, watch: Watch, signal: AbortSignal) => void}[]} */
const PARTS = [progress, warnings, actions, picture, convergence, plan];

/** @type {[string, string][]} */
const TABS = [
  ["render", "Render"],
  ["pixel", "Pixel"],
  ["plan", "Plan"],
  ["compare", "Compare"],
];

// Milliseconds before a service that does not answer is asked for the job again.
const RETRY_MS = 2000;

/** @param {HTMLElement} root @param {ViewParams} params */
export function mount(root, { id, signal }) {
  open(root, id, signal).catch((error) => !signal.aborted && refuse(root, "This job cannot be shown", error));
}

/**
 * The job, as soon as the service answers.
 *
 * @param {HTMLElement} root
 * @param {string} id
 * @param {AbortSignal} signal
 * @returns {Promise<JobDocument>}
 */
async function found(root, id, signal) {
  while (true) {
    try {
      return await get(jobPath(id), { signal });
    } catch (error) {
      if (signal.aborted || (error instanceof Problem && error.status < 500)) throw error;
      root.replaceChildren(h("p.lead", { role: "status" }, `${messageOf(error)} Trying again …`));
      await pause(RETRY_MS, signal);
    }
  }
}

/** @param {HTMLElement} root @param {string} id @param {AbortSignal} signal */
async function open(root, id, signal) {
  const watch = new Watch(await found(root, id, signal));
  signal.throwIfAborted();
  signal.addEventListener("abort", () => watch.stop());
  const entitle = () => (document.title = tabTitle(watch.job));
  watch.on("job", entitle);
  entitle();
  const frame = makeFrame(root, nameOf(watch.job), TABS, signal);
  frame.stage.append(makeNotice(watch));
  for (const part of PARTS) part.mount(frame, watch, signal);
  watch.start();
}

/** What interrupts the watch, over the picture so that nothing moves. @param {Watch} watch */
function makeNotice(watch) {
  const notice = h("p.problem.stage-notice", { role: "status" });
  const report = (/** @type {string} */ text) => (notice.textContent = text);
  watch.on("connection", (live) => report(live ? "" : "The service does not answer. Trying again …"));
  watch.on("gone", () => report("This job was deleted."));
  watch.on("lost", (error) => report(error.message));
  watch.on("locked", ({ message }) =>
    notice.replaceChildren(`${message} The page no longer follows this job. `, signInButton()),
  );
  return notice;
}
