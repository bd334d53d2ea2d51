// Links a picture to its comparison with another.

import { get } from "../../api.js";
import { h } from "../../dom.js";
import { navigate } from "../../navigation.js";
import { nameOf } from "../job/state.js";
import { placeOf } from "./place.js";

const MOST = 50;

/**
 * A form that chooses the picture to compare a finished job with.
 *
 * @param {import("../../watch.js").Watch} watch
 * @param {PictureScreen} screen
 */
export function makeComparing(watch, screen) {
  const select = h("select", { id: "compared-with" });
  const button = h("button", { type: "submit" }, "Compare");
  const form = h(
    "form",
    {
      className: "comparing",
      hidden: true,
      onsubmit: (event) => (event.preventDefault(), navigate(`/compare/${watch.id}/${select.value}${at()}`)),
    },
    h("label", { htmlFor: select.id }, "Compare with"),
    select,
    button,
  );

  /** The part that is shown here, for the address of the comparison. */
  function at() {
    const query = new URLSearchParams(
      Object.entries(placeOf(screen)).flatMap(([name, value]) => (value === null ? [] : [[name, value]])),
    );
    return query.size ? `?${query}` : "";
  }

  async function fill() {
    /** @type {JobListDocument} */
    const { jobs } = await get(`/v1/jobs?limit=${MOST}`, { signal: watch.signal });
    const { width, height } = watch.job;
    const others = jobs.filter(
      (job) =>
        job.id !== watch.id && job.state === "succeeded" && job.width === width && job.height === height,
    );
    select.replaceChildren(
      ...others.map((job) =>
        h("option", { value: job.id }, `${nameOf(job)}, ${new Date(job.created_at).toLocaleTimeString()}`),
      ),
      h("option", { value: "file" }, "a file of your own …"),
    );
    form.hidden = false;
  }

  const begin = () => watch.job.state === "succeeded" && form.hidden && fill().catch(() => {});
  watch.on("job", begin);
  begin();
  return form;
}
