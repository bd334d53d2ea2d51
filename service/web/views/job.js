// The page of a job: a viewer that fills the window. Its parts share one watch.

import { Problem, get, jobPath, messageOf } from "../api.js";
import { h, pause } from "../dom.js";
import { signInButton } from "../session.js";
import { Watch } from "../watch.js";
import * as actions from "./job/actions.js";
import * as bar from "./job/bar.js";
import * as convergence from "./job/convergence.js";
import * as picture from "./job/picture.js";
import * as plan from "./job/plan.js";
import * as progress from "./job/progress.js";
import { nameOf, tabTitle } from "./job/state.js";
import * as warnings from "./job/warnings.js";
import { makeFrame, refuse } from "./picture/frame.js";

export const title = "Job";

/** @import { Frame } from "./picture/frame.js" */

// In the order of the drawer. What they hear ends with the watch; `mount` returns what else is to be ended.
/** @type {{mount: (frame: Frame, watch: Watch) => () => void}[]} */
const PARTS = [bar, progress, warnings, actions, picture, convergence, plan];

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
export function mount(root, { id }) {
  const life = new AbortController();
  /** @type {(() => void)[]} */
  const unmounts = [];
  open(root, id, life.signal, unmounts).catch(
    (error) => !life.signal.aborted && refuse(root, "This job cannot be shown", error),
  );
  return () => {
    life.abort();
    for (const unmount of unmounts.splice(0)) unmount();
  };
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
      root.replaceChildren(
        h("p", { className: "lead", role: "status" }, `${messageOf(error)} Trying again …`),
      );
      await pause(RETRY_MS, signal);
    }
  }
}

/** @param {HTMLElement} root @param {string} id @param {AbortSignal} signal @param {(() => void)[]} unmounts */
async function open(root, id, signal, unmounts) {
  const watch = new Watch(await found(root, id, signal));
  unmounts.push(() => watch.stop());
  const entitle = () => (document.title = tabTitle(watch.job));
  watch.on("job", entitle);
  entitle();
  const frame = makeFrame(root, nameOf(watch.job), TABS);
  frame.stage.append(makeNotice(watch));
  unmounts.push(frame.close);
  for (const part of PARTS) unmounts.push(part.mount(frame, watch));
  watch.start();
}

/** What interrupts the watch, over the picture so that nothing moves. @param {Watch} watch */
function makeNotice(watch) {
  const notice = h("p", { className: "problem stage-notice", role: "status", hidden: true });
  const report = (/** @type {string} */ text, /** @type {Node[]} */ ...more) => {
    notice.replaceChildren(text, ...more);
    notice.hidden = !text;
  };
  watch.on("connection", (live) => report(live ? "" : "The service does not answer. Trying again …"));
  watch.on("gone", () => report("This job was deleted."));
  watch.on("lost", (error) => report(error.message));
  watch.on("locked", (error) =>
    report(`${error.message} The page no longer follows this job. `, signInButton()),
  );
  return notice;
}
