import { h } from "../dom.js";

export const title = "Start";

export function mount(root) {
  root.append(h("h1", {}, "Start"));
  return () => {};
}
