// The start page: choose, drop or write a scene, set its quality, get a quote, render it.

import { Problem, Unreachable, get, jobPath, messageOf, post, text } from "../api.js";
import { confirmed } from "../dialog.js";
import { announce, h, pause } from "../dom.js";
import { isScene, takeDrops } from "../drop.js";
import { makeEditor } from "../editor.js";
import { plural } from "../format.js";
import { lineStarts, readable, tokenLength } from "../json_text.js";
import { navigate } from "../navigation.js";
import { requestText, takenApart } from "../requests.js";
import { nameOf } from "./job/state.js";
import { draftOf, makeKeeper, onService, uploaded } from "./start/draft.js";
import { makeFiles } from "./start/files.js";
import { makeGallery } from "./start/gallery.js";
import { makeLabels } from "./start/labels.js";
import { helpPanel, openingPanel } from "./start/panels.js";
import { makePreview } from "./start/preview.js";
import { makeProblems } from "./start/problems.js";
import { makeQuality } from "./start/quality.js";
import { makeQuote } from "./start/quote.js";
import { makeRecent, remember } from "./start/recent.js";
import { makeValidation } from "./start/validation.js";

export const title = "Start";

// Layers that the page of the job can show.
const LAYERS = ["depth", "normal", "shape", "samples", "error"];
// Milliseconds before a service that does not answer is asked again.
const RETRY_MS = 2000;
const UNTITLED = "Untitled scene";

/** @param {HTMLElement} root @param {ViewParams} params */
export function mount(root, { query, signal }) {
  /** @type {OpenedScene["files"]} */
  const files = new Map();
  const job = query.get("job");
  // The draft of the start page itself is what opens there again.
  if (job) signal.addEventListener("abort", leave);
  /** @type {string | null} */
  let ready = null;
  // What was opened: the scene is edited if its text differs from this.
  /** @type {OpenedScene | null} */
  let origin = null;

  const keep = makeKeeper(job, draft, signal);
  const editor = makeEditor({
    label: "Scene, as JSON",
    describedBy: "scene-problems",
    onInput: changed,
    signal,
  });
  const problems = makeProblems("scene-problems", (problem) =>
    problem.line ? pointAt(editor, problem) : quality.focus(problem.pointer),
  );
  const fileList = makeFiles(addFiles);
  const quality = makeQuality(changed);
  const quote = makeQuote((chosen) => (quality.value = quality.kept(chosen)), signal);
  const preview = makePreview(signal);
  const validation = makeValidation(checked, signal);
  const gallery = makeGallery(replace, signal);
  const opening = openingPanel(addFiles, makeRecent(replace), gallery.element);
  const help = helpPanel();
  const heading = h("h1", { id: "scene-title", dir: "auto" }, "Render a scene");
  const notice = h("p", { className: "soft small notice" });
  const layers = h("input", { type: "checkbox", checked: true, onchange: keepLater });
  const labels = makeLabels(keepLater);
  const refusal = h("div", { className: "problem", role: "alert", hidden: true });
  const button = h(
    "button",
    { type: "submit", form: "order", className: "primary render", disabled: true },
    "Render",
  );

  /** @param {OpenedScene} scene */
  function open(scene) {
    files.clear();
    for (const [path, file] of scene.files) files.set(path, file);
    heading.textContent = scene.title.trim() || UNTITLED;
    notice.textContent = scene.notice ?? "";
    notice.hidden = false;
    gallery.press(scene.entry ?? "");
    restore({ layers: layers.checked, ...scene, text: readable(scene.text) });
    // As the editor has it: with its own line breaks.
    origin = { ...scene, text: editor.text };
    show();
  }

  /** Show the view, once it has a scene or a reason why it has none: then nothing moves. */
  function show() {
    if (!signal.aborted && !workbench.isConnected)
      root.replaceChildren(workbench, opening.panel, help.panel, hint);
  }

  /** @param {Pick<OpenedScene, "text" | "labels" | "layers" | "quality">} draft */
  function restore(draft) {
    editor.text = draft.text;
    labels.text = draft.labels ?? "";
    layers.checked = draft.layers ?? true;
    quality.value = draft.quality ?? null;
  }

  /** Open another scene. One that was edited is asked for first, and can be brought back. @param {OpenedScene} scene */
  async function replace(scene) {
    opening.panel.hidePopover();
    const edited = origin !== null && editor.text !== origin.text ? origin : null;
    if (edited && !(await confirmed("Replace the scene that you have edited?", "Replace it"))) return;
    leave();
    const former = draft();
    const formerFiles = new Map(files);
    open(scene);
    if (!edited) return;
    const undo = () => (open({ ...edited, files: formerFiles }), restore(former));
    notice.append(" ", h("button", { type: "button", onclick: undo }, "Undo"));
  }

  function changed() {
    ready = null;
    button.disabled = true;
    refusal.hidden = true;
    problems.wait();
    quote.clear("A quote follows when the scene is valid.");
    keepLater();
    validation.want(() => editor.text, files, quality.valid ? quality.value : null);
  }

  /** @param {import("./start/validation.js").Checked} found */
  function checked(found) {
    editor.mark(found.problems);
    entitle();
    found.problems = quality.explain(found.problems);
    if (!quality.valid) found.plan = null;
    problems.show(found);
    if (found.names) fileList.show(found.names, found.lacking, files);
    // Files that have been uploaded by now are part of the draft.
    if (files.size) keepLater();
    if (found.failure || !found.plan) preview.wait();
    if (found.failure) return quote.clear("A quote follows when the service answers again.");
    if (!found.plan) return quote.clear("A quote follows when the errors are corrected.");
    ready = found.text;
    button.disabled = false;
    preview.want(ready);
    quote.want(ready, quality.value, quality.limit);
  }

  /** A scene with another name than what was opened has its own title, and no description of the other. */
  function entitle() {
    const name = nameIn(editor.text);
    if (origin === null || name === null) return;
    const isOther = name !== nameIn(origin.text);
    const title = (isOther ? name : origin.title.trim()) || UNTITLED;
    notice.hidden = isOther && Boolean(origin.entry);
    if (heading.textContent === title) return;
    heading.textContent = title;
    keepLater();
  }

  /** @param {OpenedScene["files"]} added - By path. */
  async function addFiles(added) {
    const scene = [...added].find(([path]) => isScene(path));
    if (scene?.[1] instanceof Blob) {
      const [path, file] = scene;
      added.delete(path);
      await replace({ title: path.slice(path.lastIndexOf("/") + 1), text: await file.text(), files: added });
    } else {
      for (const [path, file] of added) files.set(path, file);
      changed();
    }
    announce(`${plural(added.size + (scene ? 1 : 0), "file")} added`);
  }

  /** @returns {import("./start/draft.js").Draft} */
  function draft() {
    return {
      title: heading.textContent ?? "",
      text: editor.text,
      entry: origin?.entry ?? "",
      quality: quality.value,
      labels: labels.text,
      layers: layers.checked,
      files: uploaded(files),
    };
  }

  /** Put a scene that was written, or came from a file, on the list of recent ones. */
  function leave() {
    if (origin !== null && (editor.text !== origin.text || !(origin.entry || job))) remember(draft());
  }

  function keepLater() {
    if (origin !== null) keep();
  }

  /** @param {SubmitEvent} event */
  async function submit(event) {
    event.preventDefault();
    if (ready === null || button.disabled || !labels.check()) return;
    button.disabled = true;
    const wanted = {
      ...origin?.more,
      quality: quote.chosen ? quality.kept(quote.chosen) : quality.value,
      layers: layers.checked ? (origin?.layerNames ?? LAYERS) : null,
      labels: labels.value,
    };
    try {
      /** @type {JobDocument} */
      const made = await post("/v1/jobs", requestText(ready, wanted), { signal });
      leave();
      navigate(`/jobs/${made.id}`);
    } catch (error) {
      if (signal.aborted) return;
      const ofLabels = error instanceof Problem && labels.refuse(error.errors);
      refusal.textContent = messageOf(error);
      refusal.hidden = ofLabels;
      button.disabled = false;
    }
  }

  const form = h(
    "form",
    { className: "order", id: "order", onsubmit: submit },
    preview.element,
    h(
      "div",
      { className: "settings" },
      h("div", {}, quality.element, layersChoice(layers), labels.element),
      quote.element,
    ),
  );
  const writing = h(
    "section",
    { className: "writing", "aria-labelledby": "scene-title" },
    h(
      "div",
      { className: "row spread" },
      heading,
      h("div", { className: "row" }, opening.button, help.button),
    ),
    notice,
    h("div", { className: "sheet" }, editor.element, problems.element),
    fileList.element,
  );
  const workbench = h(
    "div",
    { className: "workbench" },
    writing,
    form,
    h("div", { className: "foot" }, refusal, button),
  );
  const hint = h("div", { className: "drop-hint", "aria-hidden": "true" }, "Drop a scene and its files");
  const dropped = takeDrops(addFiles, signal);
  root.addEventListener(
    "keydown",
    (event) => event.key === "Enter" && (event.ctrlKey || event.metaKey) && form.requestSubmit(),
    { signal },
  );

  begin().then(() => dropped && addFiles(dropped));

  /** Open what the address or the draft names, as soon as the service answers. */
  async function begin() {
    try {
      await openFirst(await draftOf(job), await gallery.fill());
    } catch (error) {
      if (signal.aborted) return;
      show();
      const failure = error instanceof Error ? error : new Error(String(error));
      problems.show({ problems: [], more: 0, warnings: [], failure, plan: null });
      if (!(error instanceof Unreachable)) return;
      await pause(RETRY_MS, signal);
      if (!signal.aborted) await begin();
    }
  }

  /**
   * @param {import("./start/draft.js").Draft | null} kept
   * @param {import("./start/gallery.js").GalleryEntry[]} entries
   */
  async function openFirst(kept, entries) {
    const scene = job ? await sceneOf(job, signal) : null;
    // What was dropped meanwhile stays.
    if (origin !== null) return;
    if (scene) open(scene);
    else if (kept && !kept.entry) open({ ...kept, files: new Map() });
    else if (!(await gallery.choose(entries.find(({ name }) => name === kept?.entry) ?? entries[0]))) return;
    if (!kept) return;
    for (const [path, file] of onService(kept.files)) files.set(path, file);
    restore(kept);
  }
}

/** @param {string} id @param {AbortSignal} signal @returns {Promise<OpenedScene>} */
async function sceneOf(id, signal) {
  /** @type {JobDocument} */
  const job = await get(jobPath(id), { signal });
  const request = takenApart(await text(`${jobPath(id)}/request`, { signal }));
  return {
    title: nameOf(job),
    text: request.scene,
    quality: request.quality,
    labels: Object.entries(request.labels)
      .map(([name, value]) => (value ? `${name}:${value}` : name))
      .join(", "),
    layers: request.layers.length > 0,
    layerNames: request.layers.length ? request.layers : undefined,
    more: request.more,
    notice: also(request.more),
    files: new Map(),
  };
}

/** The name that a scene gives itself, empty without one; null while it is no JSON. @param {string} text */
function nameIn(text) {
  if (!text.trim()) return "";
  try {
    return String(JSON.parse(text)?.name ?? "").trim();
  } catch {
    return null;
  }
}

/** Fields that no control shows. @param {Record<string, unknown>} more */
function also(more) {
  const fields = Object.entries(more).map(
    ([name, value]) => `${name.replaceAll("_", " ")} ${JSON.stringify(value)}`,
  );
  return fields.length ? `Rendered again with ${fields.join(" and ")}.` : "";
}

/** @param {HTMLInputElement} layers */
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

/** @param {import("../editor.js").Editor} editor @param {ProblemEntry} problem - With a line. */
function pointAt(editor, { line, column }) {
  const { text } = editor;
  const start = lineStarts(text)[(line ?? 1) - 1] + (column ?? 1) - 1;
  editor.point(start, start + tokenLength(text, start));
}
