// Links a picture to its comparison with another.

import { get } from "../../api.js";
import { h } from "../../dom.js";
import { ago, codeValues, qualityName, seconds } from "../../format.js";
import { navigate } from "../../navigation.js";
import { existedAlready, nameOf } from "../job/state.js";

const MOST = 50;

/**
 * A form that chooses the picture to compare that of a finished job with.
 *
 * @param {JobDocument} job
 * @param {() => void} write - Brings the address up to date: the comparison shows what is shown here.
 * @param {AbortSignal} signal
 */
export function makeComparing(job, write, signal) {
  /** @type {HTMLSelectElement} */
  const select = h("select", { id: "compared-with" });
  const hint = h("p.soft.small", "Change and render again with another quality, then compare here.");
  const form = h(
    "form.comparing",
    {
      hidden: true,
      onsubmit: compare,
    },
    h("label", { htmlFor: select.id }, "Compare with"),
    select,
    hint,
    h("button", { type: "submit" }, "Compare"),
  );

  /** @param {SubmitEvent} event */
  function compare(event) {
    event.preventDefault();
    write();
    navigate(`/compare/${job.id}/${select.value}${location.search}`);
  }

  /** Ask for the list of jobs again, and keep what is chosen. */
  async function fill() {
    /** @type {JobListDocument} */
    const { jobs } = await get(`/v1/jobs?limit=${MOST}&state=succeeded`, { signal });
    const others = jobs.filter(
      ({ id, width, height }) => id !== job.id && width === job.width && height === job.height,
    );
    const chosen = select.value;
    select.replaceChildren(
      ...others.map((other) => h("option", { value: other.id }, labelOf(other))),
      h("option", { value: "file" }, "a file of your own …"),
    );
    if (others.some(({ id }) => id === chosen)) select.value = chosen;
    hint.hidden = others.length > 0;
    form.hidden = false;
  }

  return { element: form, fill: () => fill().catch(() => {}) };
}

/** What tells a job from others of its scene. @param {JobDocument} job */
function labelOf(job) {
  const { quality, error, run_seconds: time, created_at: at } = job;
  const cost = existedAlready(job) ? "existed already" : seconds(time ?? 0);
  const result = error ? `error ${codeValues(error.estimate)} / 255` : cost;
  return `${nameOf(job)}: ${qualityName(quality)}; ${result}; ${ago(at)}`;
}
