// Builds the page of a release from service/web into service/built_web: one script beside the editor's, and one style
// sheet, in place of a hundred files.

import { cp, mkdir, readFile, readdir, rm, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build, transform } from "esbuild";

const SERVICE = join(dirname(fileURLToPath(import.meta.url)), "../../service");
const WEB = join(SERVICE, "web");
const BUILT = join(SERVICE, "built_web");
// The reference of the API has a page of its own; the editor is built already.
const COPIED = ["docs.css", "gallery.json", "icon.svg", "thumbnails", "vendor"];

const EDITOR = { path: "./vendor/codemirror/codemirror.js", external: true };

/** All views in one script: split by view, a job's would ask for eight. */
async function script() {
  const { outputFiles } = await build({
    absWorkingDir: WEB,
    entryPoints: ["main.js"],
    bundle: true,
    minify: true,
    format: "esm",
    target: "es2022",
    legalComments: "none",
    write: false,
    plugins: [
      { name: "editor", setup: ({ onResolve }) => onResolve({ filter: /codemirror\.js$/ }, () => EDITOR) },
    ],
  });
  return outputFiles[0].text;
}

/** The style sheets of the frame and of all views. */
async function styles() {
  const names = await readdir(WEB, { recursive: true });
  const first = ["style.css", "editor.css"];
  const others = names
    .filter((name) => name.endsWith(".css") && ![...first, "docs.css"].includes(name))
    .sort();
  const texts = await Promise.all([...first, ...others].map((name) => readFile(join(WEB, name), "utf8")));
  return (await transform(texts.join("\n"), { loader: "css", minify: true })).code;
}

/** The page without hints of modules that are in its script now, and with the mark of a style sheet that has all. */
async function page() {
  const html = await readFile(join(WEB, "index.html"), "utf8");
  return html
    .replace(/\s*<link rel="modulepreload"[^>]*>/g, "")
    .replace('href="/web/style.css"', "$& data-all");
}

const files = { "main.js": await script(), "style.css": await styles(), "index.html": await page() };
await rm(BUILT, { recursive: true, force: true });
await mkdir(BUILT);
for (const name of COPIED) await cp(join(WEB, name), join(BUILT, name), { recursive: true });
for (const [name, content] of Object.entries(files)) await writeFile(join(BUILT, name), content);
