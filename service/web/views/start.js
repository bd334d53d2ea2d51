// The start page: choose, drop or write a scene, set its quality, get a quote, render it.

import { get, jobPath, post, text } from "../api.js";
import { announce, h } from "../dom.js";
import { makeEditor } from "../editor.js";
import { plural } from "../format.js";
import { lineStarts, readable } from "../json_text.js";
import { navigate } from "../navigation.js";
import { requestText, takenApart } from "../requests.js";
import { acceptDrops, chosen, isScene } from "./start/drop.js";
import { makeFiles } from "./start/files.js";
import { makeGallery } from "./start/gallery.js";
import { makeProblems } from "./start/problems.js";
import { makeQuality } from "./start/quality.js";
import { makeQuote } from "./start/quote.js";
import { makeValidation } from "./start/validation.js";

export const title = "Start";

// Layers that the page of the job can show.
const LAYERS = ["depth", "normal", "shape", "samples", "error"];
const DRAFT = "penumbra-draft";

export function mount(root, { query }) {
  const life = new AbortController();
  const { signal } = life;
  const files = new Map();
  let ready = null;

  const editor = makeEditor({ label: "Scene, as JSON", describedBy: "scene-problems", onInput: changed });
  const problems = makeProblems("scene-problems", (problem) => pointAt(editor, problem));
  const fileList = makeFiles(addFiles);
  const quality = makeQuality(changed);
  const quote = makeQuote((chosen) => (quality.value = quality.kept(chosen)), signal);
  const validation = makeValidation(checked, signal);
  const gallery = makeGallery(open, signal);
  const heading = h("h2", { id: "scene-title" }, "Scene");
  const notice = h("p", { className: "soft notice" });
  const layers = h("input", { type: "checkbox", checked: true });
  const labels = h("input", {
    type: "text",
    placeholder: "course:graphics, week:3",
    autocomplete: "off",
    spellcheck: false,
  });
  const refusal = h("div", { className: "problem", role: "alert", hidden: true });
  const button = h("button", { type: "submit", className: "primary render", disabled: true }, "Render");

  function open(scene) {
    files.clear();
    for (const [path, file] of scene.files) files.set(path, file);
    heading.textContent = scene.title;
    notice.textContent = scene.notice ?? "";
    editor.text = readable(scene.text);
    quality.value = scene.quality ?? null;
  }

  function changed() {
    ready = null;
    button.disabled = true;
    refusal.hidden = true;
    problems.wait();
    quote.clear("A quote follows when the scene is valid.");
    keep();
    validation.want(editor.text, files, quality.value);
  }

  function checked(found) {
    editor.mark(found.problems);
    problems.show(found);
    fileList.show(found.names, found.lacking, files);
    if (!found.plan) return quote.clear("There is no quote for a scene with errors.");
    ready = found.text;
    button.disabled = false;
    quote.want(ready, quality.value, quality.limit);
  }

  async function addFiles(added) {
    const scene = [...added].find(([path]) => isScene(path));
    if (scene) {
      const [path, file] = scene;
      gallery.release();
      added.delete(path);
      open({ title: path.slice(path.lastIndexOf("/") + 1), text: await file.text(), files: added });
    } else {
      for (const [path, file] of added) files.set(path, file);
      changed();
    }
    announce(`${plural(added.size + (scene ? 1 : 0), "file")} added`);
  }

  function keep() {
    // Where storage is full or forbidden, a reload loses the draft.
    try {
      sessionStorage.setItem(DRAFT, JSON.stringify({ text: editor.text, entry: gallery.chosen }));
    } catch {
      sessionStorage.clear();
    }
  }

  async function submit(event) {
    event.preventDefault();
    if (ready === null || button.disabled) return;
    button.disabled = true;
    const wanted = {
      quality: quote.chosen ? quality.kept(quote.chosen) : quality.value,
      layers: layers.checked ? LAYERS : null,
      labels: labelled(labels.value),
    };
    try {
      const job = await post("/v1/jobs", requestText(ready, wanted), { signal });
      navigate(`/jobs/${job.id}`);
    } catch (error) {
      if (signal.aborted) return;
      refusal.textContent = error.message;
      refusal.hidden = false;
      button.disabled = false;
    }
  }

  const form = h(
    "form",
    { className: "order", onsubmit: submit },
    quality.element,
    layersChoice(layers),
    labelsField(labels),
    quote.element,
    refusal,
    button,
    h("p", { className: "soft small keys" }, "Ctrl + Enter also renders."),
  );
  const picker = h("input", {
    type: "file",
    multiple: true,
    className: "unseen",
    onchange: () => (addFiles(chosen(picker.files)), (picker.value = "")),
  });
  const writing = h(
    "section",
    { className: "writing", "aria-labelledby": "scene-title" },
    h(
      "div",
      { className: "row spread" },
      heading,
      h("label", { className: "button" }, picker, "Open files …"),
    ),
    notice,
    editor.element,
    problems.element,
    fileList.element,
  );
  const lead = h(
    "p",
    { className: "lead" },
    "Choose one, drop your own with its textures anywhere on this page, or write it here.",
  );
  root.append(
    h(
      "div",
      { className: "workbench" },
      h("div", {}, h("h1", {}, "Render a scene"), lead, gallery.element, writing),
      form,
    ),
    h("div", { className: "drop-hint", "aria-hidden": "true" }, "Drop the scene and its files"),
  );
  acceptDrops(addFiles, signal);
  root.addEventListener(
    "keydown",
    (event) => event.key === "Enter" && (event.ctrlKey || event.metaKey) && form.requestSubmit(),
    { signal },
  );

  begin().catch((error) => {
    if (!signal.aborted) problems.show({ problems: [], more: 0, failure: error });
  });

  async function begin() {
    const entries = await gallery.fill();
    const job = query.get("job");
    const draft = JSON.parse(sessionStorage.getItem(DRAFT) ?? "null");
    if (job) return open(await sceneOf(job, signal));
    await gallery.choose(entries.find(({ name }) => name === draft?.entry) ?? entries[0]);
    if (!draft || draft.text === editor.text) return;
    if (!draft.entry) open({ title: "Your draft", text: draft.text, files: new Map() });
    else editor.text = draft.text;
    changed();
  }

  return () => life.abort();
}

async function sceneOf(id, signal) {
  const job = await get(jobPath(id), { signal });
  const { scene, quality } = takenApart(await text(`${jobPath(id)}/request`, { signal }));
  return { title: job.name ?? "Untitled scene", text: scene, quality, files: new Map() };
}

function layersChoice(layers) {
  return h(
    "label",
    { className: "layers-choice" },
    layers,
    h(
      "span",
      {},
      "Keep layers for inspection ",
      h("span", { className: "soft small" }, "depth, normals, shapes, samples, errors"),
    ),
  );
}

function labelsField(input) {
  return h(
    "label",
    { className: "field" },
    h("span", { className: "label" }, "Labels, for finding the job later"),
    input,
  );
}

/** Labels as an object, or null if there are none. */
function labelled(text) {
  const pairs = text
    .split(",")
    .map((part) => part.trim())
    .filter(Boolean)
    .map((part) => part.split(/:(.*)/s, 2));
  return pairs.length
    ? Object.fromEntries(pairs.map(([name, value = ""]) => [name.trim(), value.trim()]))
    : null;
}

function pointAt(editor, { line, column }) {
  const start = lineStarts(editor.text)[line - 1] + column - 1;
  const rest = /^("(?:[^"\\]|\\.)*"|[^\s,\]}]+)?/.exec(editor.text.slice(start))[0];
  editor.point(start, start + rest.length);
}
