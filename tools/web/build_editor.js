// Builds service/web/vendor/codemirror from the packages that package-lock.json pins: `npm run editor`.
// With --check nothing is written, and a file that differs from the build is an error.

import { readFile, writeFile } from "node:fs/promises";
import { dirname, join, relative } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const HERE = dirname(fileURLToPath(import.meta.url));
const ROOT = join(HERE, "../..");
const VENDOR = join(ROOT, "service/web/vendor/codemirror");
const PACKAGE = /node_modules\/((?:@[^/]+\/)?[^/]+)\//;
// Style sheets are adopted by shadow roots alone, and documents get a <style>, which the page's policy refuses.
const ADOPTS = "if (!root.head && root.adoptedStyleSheets";

const adopted = {
  name: "adopted-style-sheets",
  setup: ({ onLoad }) =>
    onLoad({ filter: /style-mod[\\/]src[\\/]style-mod\.js$/ }, async ({ path }) => {
      const text = await readFile(path, "utf8");
      if (!text.includes(ADOPTS)) throw new Error(`${path} no longer has the line: ${ADOPTS}`);
      return { contents: text.replace(ADOPTS, "if (root.adoptedStyleSheets") };
    }),
};

/** The script, and the packages that are in it, by name. */
async function bundled() {
  const { outputFiles, metafile } = await build({
    absWorkingDir: HERE,
    entryPoints: ["codemirror.js"],
    bundle: true,
    minify: true,
    format: "esm",
    target: "es2022",
    legalComments: "none",
    banner: {
      js: "/* CodeMirror, built by tools/web/build_editor.js; VERSION and LICENSE are beside this file. */",
    },
    plugins: [adopted],
    write: false,
    metafile: true,
  });
  const names = Object.keys(metafile.inputs).flatMap((path) => PACKAGE.exec(path)?.[1] ?? []);
  return { script: outputFiles[0].text, packages: [...new Set(names)].sort() };
}

async function versions(packages) {
  const lines = packages.map(async (name) => {
    const { version, license } = JSON.parse(
      await readFile(join(ROOT, "node_modules", name, "package.json"), "utf8"),
    );
    return `${name} ${version}, ${license}`;
  });
  const head = [
    "CodeMirror 6, built by `npm run editor`: https://codemirror.net",
    "Changed in style-mod: a document adopts its style sheets as shadow roots do.",
  ];
  return `${[...head, "", ...(await Promise.all(lines))].join("\n")}\n`;
}

/** Each licence once, with the packages under it. */
async function licences(packages) {
  const shared = new Map();
  for (const name of packages) {
    const text = (await readFile(join(ROOT, "node_modules", name, "LICENSE"), "utf8")).trim();
    shared.set(text, [...(shared.get(text) ?? []), name]);
  }
  return `${Array.from(shared, ([text, names]) => `${names.join(", ")}\n\n${text}`).join("\n\n----\n\n")}\n`;
}

const { script, packages } = await bundled();
const files = {
  "codemirror.js": script,
  VERSION: await versions(packages),
  LICENSE: await licences(packages),
};
for (const [name, content] of Object.entries(files)) {
  const path = join(VENDOR, name);
  if (!process.argv.includes("--check")) await writeFile(path, content);
  else if ((await readFile(path, "utf8").catch(() => null)) !== content) {
    console.error(`${relative(process.cwd(), path)} differs from its build. Run: npm run editor`);
    process.exitCode = 1;
  }
}
