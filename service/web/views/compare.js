import { h } from "../dom.js";

export const title = "Compare";

export function mount(root) {
  root.append(h("h1", {}, "Compare"));
  return () => {};
}
