// The page of a job: hosts the panels, which all hear of the job through one watch.

import { get, jobPath } from "../api.js";
import { h } from "../dom.js";
import { Watch } from "../watch.js";

export const title = "Job";

// Each has mount(root, watch) -> unmount(), and hears no more of anything once watch.signal is aborted.
const PANELS = [["picture", () => import("./picture/panel.js")]];

export function mount(root, { id }) {
  const life = new AbortController();
  const unmounts = [];
  open(root, id, life.signal, unmounts);
  return () => {
    life.abort();
    for (const unmount of unmounts.splice(0)) unmount();
  };
}

async function open(root, id, signal, unmounts) {
  const job = await get(jobPath(id), { signal });
  const watch = new Watch(job);
  unmounts.push(() => watch.stop());
  root.append(h("h1", {}, job.name ?? "A scene without a name"));
  for (const [name, load] of PANELS) {
    const place = h("section", { className: `panel-${name}` });
    root.append(place);
    const panel = await load();
    if (signal.aborted) return;
    unmounts.push(panel.mount(place, watch));
  }
  watch.start();
}
