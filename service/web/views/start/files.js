// The files that the scene refers to, and which of them are available.

import { filesFor } from "../../assets.js";
import { h } from "../../dom.js";
import { bytes } from "../../format.js";
import { chosen } from "../../drop.js";

/** @import { StoredFile } from "../../assets.js" */

const MESH = /\.(obj|ply|gltf|glb)$/i;
const IMAGE = /\.(png|jpe?g|webp|tiff?|bmp|gif|ppm|pfm|hdr|exr)$/i;

/** @param {(files: Map<string, Blob | StoredFile>) => void} onFiles */
export function makeFiles(onFiles) {
  const list = h("ul", { className: "files" });
  const element = h(
    "section",
    { className: "files-box", hidden: true },
    h("h3", {}, "Textures and meshes"),
    list,
  );

  /**
   * @param {Map<string, string[]>} names - That the scene has, with their pointers.
   * @param {Map<string, string>} lacking - Reasons by name.
   * @param {Map<string, Blob | StoredFile>} files - By path.
   */
  function show(names, lacking, files) {
    const found = filesFor(names.keys(), files);
    const used = new Set(Array.from(found.values(), ({ file }) => file));
    const unused = [...files].filter(([, file]) => !used.has(file)).map(([path]) => path);
    element.hidden = names.size === 0 && unused.length === 0;
    list.replaceChildren(
      ...Array.from(names.keys(), (name) => h("li", {}, h("code", { dir: "auto" }, name), ...state(name))),
      ...unused.map((path) =>
        h("li", {}, h("code", { dir: "auto" }, path), h("span", { className: "soft" }, use(path))),
      ),
    );

    /** @param {string} name */
    function state(name) {
      const { file, several } = /** @type {import("../../assets.js").Found} */ (found.get(name));
      if (file && !lacking.has(name))
        return [h("span", { className: "soft" }, `here, ${bytes(file.size)}`), chooser(name, "Replace")];
      return [
        ...several.map((path) => offer(name, path)),
        chooser(name, `Choose ${name.slice(name.lastIndexOf("/") + 1)}`),
      ];
    }

    /** @param {string} name @param {string} path */
    function offer(name, path) {
      const use = () => onFiles(new Map([[name, /** @type {Blob | StoredFile} */ (files.get(path))]]));
      return h(
        "button",
        { type: "button", onclick: use, "aria-label": `Use ${path} as ${name}` },
        `Use ${path}`,
      );
    }

    /** @param {string} name @param {string} label */
    function chooser(name, label) {
      /** @type {HTMLInputElement} */
      const input = h("input", {
        type: "file",
        className: "unseen",
        onchange: () => onFiles(renamed(name, input.files)),
      });
      return h("label", { className: "button", title: `Choose the file ${name}` }, input, label);
    }
  }

  return { element, show };
}

/** How a scene would use a file that it does not name. @param {string} path */
function use(path) {
  const name = JSON.stringify(path.slice(path.lastIndexOf("/") + 1));
  if (MESH.test(path))
    return `Not used. Under "shapes" write {"type": "mesh", "asset": ${name}, "material": …}.`;
  if (IMAGE.test(path)) return `Not used. Under "textures" write {"type": "image", "asset": ${name}}.`;
  return "Scenes use no files of this kind.";
}

/** Use the chosen file for this name, whatever its own name is. @param {string} name @param {FileList | null} list */
function renamed(name, list) {
  return new Map(Array.from(chosen(list).values(), (file) => [name, file]));
}
