// Links a picture to its comparison with another.

import { get } from "../../api.js";
import { h } from "../../dom.js";
import { navigate } from "../../navigation.js";

const MOST = 50;

/** A form that chooses the picture to compare a finished job with. */
export function makeComparing(watch) {
  const select = h("select", { id: "compared-with" });
  const button = h("button", { type: "submit" }, "Compare");
  const form = h(
    "form",
    {
      className: "row comparing",
      hidden: true,
      onsubmit: (event) => (event.preventDefault(), navigate(`/compare/${watch.id}/${select.value}`)),
    },
    h("label", { htmlFor: select.id }, "Compare with"),
    select,
    button,
  );

  async function fill() {
    const { jobs } = await get(`/v1/jobs?limit=${MOST}`, { signal: watch.signal });
    const { width, height } = watch.job;
    const others = jobs.filter(
      (job) =>
        job.id !== watch.id && job.state === "succeeded" && job.width === width && job.height === height,
    );
    select.replaceChildren(
      ...others.map((job) =>
        h(
          "option",
          { value: job.id },
          `${job.name ?? "untitled"}, ${new Date(job.created_at).toLocaleTimeString()}`,
        ),
      ),
      h("option", { value: "file" }, "a file of yours …"),
    );
    form.hidden = false;
  }

  const begin = () => watch.job.state === "succeeded" && form.hidden && fill().catch(() => {});
  watch.on("job", begin);
  begin();
  return form;
}
