// Links a picture to its comparison with another.

import { get } from "../../api.js";
import { h } from "../../dom.js";
import { navigate } from "../../navigation.js";
import { nameOf } from "../job/state.js";
import { placeOf } from "./place.js";

const MOST = 50;

/**
 * A form that chooses the picture to compare that of a finished job with.
 *
 * @param {JobDocument} job
 * @param {PictureScreen} screen
 * @param {AbortSignal} signal
 */
export function makeComparing(job, screen, signal) {
  /** @type {HTMLSelectElement} */
  const select = h("select", { id: "compared-with" });
  const form = h(
    "form.comparing",
    {
      hidden: true,
      onsubmit: (event) => (event.preventDefault(), navigate(`/compare/${job.id}/${select.value}${at()}`)),
    },
    h("label", { htmlFor: select.id }, "Compare with"),
    select,
    h("button", { type: "submit" }, "Compare"),
  );

  /** The part that is shown here, for the address of the comparison. */
  function at() {
    const query = new URLSearchParams(
      Object.entries(placeOf(screen)).flatMap(([name, value]) => (value === null ? [] : [[name, value]])),
    );
    return query.size ? `?${query}` : "";
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
