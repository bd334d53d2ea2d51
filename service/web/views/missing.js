// No view has this address.

import { h } from "../dom.js";

export const title = "No such page";

export function mount(root) {
  root.append(
    h("h1", {}, "There is no such page"),
    h(
      "p",
      { className: "lead" },
      "Perhaps it is among the ",
      h("a", { href: "/jobs" }, "jobs"),
      ", or begin with a ",
      h("a", { href: "/" }, "scene"),
      ".",
    ),
  );
  return () => {};
}
