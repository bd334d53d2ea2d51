// The files that the scene refers to, and which of them are available.

import { fileFor } from "../../assets.js";
import { h } from "../../dom.js";
import { bytes } from "../../format.js";
import { chosen } from "./drop.js";

/** @param {(files: Map<string, File>) => void} onFiles */
export function makeFiles(onFiles) {
  const list = h("ul", { className: "files" });
  const element = h(
    "section",
    { className: "files-box", hidden: true },
    h("h3", {}, "Textures and meshes"),
    list,
  );

  function show(names, lacking, files) {
    element.hidden = names.size === 0;
    list.replaceChildren(
      ...Array.from(names.keys(), (name) => h("li", {}, h("code", {}, name), state(name))),
    );

    function state(name) {
      if (!lacking.has(name))
        return h("span", { className: "soft" }, `here, ${bytes(fileFor(name, files).size)}`);
      const input = h("input", {
        type: "file",
        className: "unseen",
        onchange: () => onFiles(renamed(name, input.files)),
      });
      return h("label", { className: "button" }, input, `Choose ${name.slice(name.lastIndexOf("/") + 1)}`);
    }
  }

  return { element, show };
}

/** Use the chosen file for this name, whatever its own name is. */
function renamed(name, list) {
  return new Map(Array.from(chosen(list).values(), (file) => [name, file]));
}
