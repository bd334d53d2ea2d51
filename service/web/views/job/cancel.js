// Cancelling a job, from its page and from the list.

import { post } from "../../api.js";
import { confirmed } from "../../dialog.js";
import { nameOf } from "./state.js";

/** Cancel a job; where work would be lost, after a question. @param {JobDocument} job */
export async function cancel(job) {
  const question = `Cancel ${nameOf(job)}? What has been rendered is lost.`;
  if (job.started_at && !(await confirmed(question, "Cancel it"))) return;
  await post(job.links.cancel, {});
}
