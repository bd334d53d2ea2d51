import { h } from "../dom.js";

export const title = "Jobs";

export function mount(root) {
  root.append(h("h1", {}, "Jobs"));
  return () => {};
}
