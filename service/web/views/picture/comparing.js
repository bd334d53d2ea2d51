// Links a picture to its comparison with another.

import { get } from "../../api.js";
import { h } from "../../dom.js";
import { navigate } from "../../navigation.js";
import { nameOf } from "../job/state.js";

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
  const form = h(
    "form.comparing",
    {
      hidden: true,
      onsubmit: compare,
    },
    h("label", { htmlFor: select.id }, "Compare with"),
    select,
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
      ...others.map((other) => h("option", { value: other.id }, `${nameOf(other)}, ${timeOf(other)}`)),
      h("option", { value: "file" }, "a file of your own …"),
    );
    if (others.some(({ id }) => id === chosen)) select.value = chosen;
    form.hidden = false;
  }

  return { element: form, fill: () => fill().catch(() => {}) };
}

/** @param {JobDocument} job */
const timeOf = (job) => new Date(job.created_at).toLocaleTimeString();
