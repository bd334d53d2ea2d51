// The picture of a job.

import { h } from "../../dom.js";

export function mount(root, watch) {
  const image = h("img", { alt: `The picture of ${watch.job.name ?? "the job"} so far`, src: watch.job.links.image_png });
  watch.on("tiles", (batch) => {
    if (batch.tiles.length) image.src = `${watch.job.links.image_png}?after=${batch.next}`;
  });
  root.append(image);
  return () => {};
}
