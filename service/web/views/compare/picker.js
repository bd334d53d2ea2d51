// The form that chooses a file to compare with.

import { h } from "../../dom.js";
import { field } from "../../elements.js";

/** @import { Encoding } from "./references.js" */

/** @param {(file: File, encoding: Encoding) => void} chosen */
export function makePicker(chosen) {
  const file = h("input", { id: "reference-file", type: "file", accept: ".png,.npy,.exr", required: true });
  const encoding = h(
    "select",
    { id: "reference-encoding" },
    [
      ["", "the default of its format"],
      ["srgb", "sRGB"],
      ["linear", "linear"],
    ].map(([value, name]) => h("option", { value }, name)),
  );
  const submit = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    if (file.files?.[0]) chosen(file.files[0], /** @type {Encoding} */ (encoding.value));
  };
  return h(
    "form",
    { className: "comparing", onsubmit: submit },
    field("Reference: a PNG, NPY or EXR file", file),
    field("Its values are", encoding),
    h("button", { type: "submit", className: "primary" }, "Compare"),
  );
}
