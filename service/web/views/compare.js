// Compares two pictures: split along a line, in turn, by their difference, and by the verdict of the service.

import { get, jobPath, post } from "../api.js";
import { announce, h } from "../dom.js";
import { Blending, HOTTEST, MODES } from "./compare/blending.js";
import { bitmapOf, encoded, filmOfJob, referenceIn } from "./compare/pictures.js";
import { makeVerdict } from "./compare/verdict.js";
import { displayOf, makeDisplay, makeZoom } from "./picture/controls.js";
import { KEYS } from "./picture/keys.js";
import { makeLegend } from "./picture/legend.js";
import { keepPlace } from "./picture/place.js";
import { Screen } from "./picture/screen.js";
import { catchLine, hearSpace } from "./picture/split.js";

export const title = "Compare";

// Instead of a job's id: a file still to be chosen.
const FILE = "file";

export function mount(root, { a, b }) {
  const life = new AbortController();
  const { signal } = life;
  const names = h("p", { className: "lead compared-names" });
  const place = h("div", { "aria-busy": "true" });
  root.append(h("h1", {}, "Compare"), names, place);
  let screen = null;

  function fail(error) {
    if (signal.aborted) return;
    place.removeAttribute("aria-busy");
    place.append(
      h(
        "p",
        { className: "problem", role: "alert" },
        [error.message, ...(error.errors ?? []).map((one) => one.detail)]
          .filter((text, i, all) => all.indexOf(text) === i)
          .join(" "),
      ),
    );
  }

  async function compare(reference, other) {
    place.replaceChildren(h("p", { className: "soft", role: "status" }, "Comparing …"));
    const body = { image: { job: a }, reference, pictures: true };
    const [answer, film] = await Promise.all([
      post("/v1/comparisons", body, { signal }),
      filmOfJob(a, signal),
    ]);
    const films = [film, await (other ?? referenceIn(answer.images.side_by_side, film.width, film.height))];
    const { scene } = await get(`${jobPath(a)}/request`, { signal });
    screen = show(place, films, answer, await bitmapOf(answer.images.heat_map), displayOf(scene), signal);
  }

  async function begin() {
    const job = await get(jobPath(a), { signal });
    const link = (one) => h("a", { href: `/jobs/${one.id}` }, one.name ?? "an untitled scene");
    if (b === FILE) {
      names.append("A is ", link(job), ", B a file of yours.");
      place.replaceChildren(picker((sent) => compare(sent).catch(fail)));
      return;
    }
    const other = await get(jobPath(b), { signal });
    names.append("A is ", link(job), ", B is ", link(other), ".");
    await compare({ job: b }, filmOfJob(b, signal));
  }

  begin().catch(fail);
  return () => {
    life.abort();
    screen?.close();
  };
}

function picker(chosen) {
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
  const submit = async (event) => {
    event.preventDefault();
    chosen({ content: await encoded(file.files[0]), ...(encoding.value && { encoding: encoding.value }) });
  };
  return h(
    "form",
    { className: "panel row reference", onsubmit: submit },
    h(
      "div",
      { className: "field" },
      h("label", { htmlFor: file.id }, "Reference: a PNG, NPY or EXR file"),
      file,
    ),
    h("div", { className: "field" }, h("label", { htmlFor: encoding.id }, "Its values are"), encoding),
    h("button", { type: "submit", className: "primary" }, "Compare"),
  );
}

function show(place, films, answer, heat, asked, signal) {
  const [{ width, height }] = films;
  let region = null;
  const screen = new Screen({
    width,
    height,
    label: `Pictures A and B, ${width} by ${height} pixels`,
    overlay,
  });
  const blending = new Blending(screen, films, heat);
  const display = makeDisplay(() => blending.expose(display.exposure, display.transfer), "compare");
  const legend = h("div");
  const readout = h("p", { className: "readout number" });
  const keys = h(
    "p",
    { className: "soft small", id: "compare-keys" },
    `Hold Space for B; F switches between A and B. ${KEYS.split(" Enter")[0]}`,
  );
  const line = h("input", {
    id: "split-line",
    type: "range",
    min: 0,
    max: 100,
    step: 0.5,
    value: 50,
    oninput: () => blending.split(line.value / 100),
  });
  catchLine(screen, {
    at: () => (blending.mode === "split" ? blending.at : null),
    move: (share) => {
      line.value = 100 * share;
      blending.split(share);
    },
  });
  // Space shows B as long as it is held; the choice of what is shown stays as it is.
  hearSpace((held) => blending.show(held ? "b" : modes.chosen), signal);
  const lineField = h(
    "div",
    { className: "field split-line" },
    h("label", { htmlFor: line.id }, "Line between A and B"),
    line,
  );
  const modes = makeModes(change);

  function overlay(context) {
    blending.overlay(context);
    if (region) screen.outline(context, region, "#ffb43c");
  }

  function change(mode) {
    blending.show(mode);
    lineField.hidden = mode !== "split";
    const scale = { name: "difference", kind: "scale", low: 0, high: HOTTEST };
    const legends = {
      difference: makeLegend(scale),
      heat: h(
        "p",
        { className: "soft small legend" },
        `The displayed difference, from black to white at ${HOTTEST}.`,
      ),
    };
    legend.replaceChildren(legends[mode] ?? "");
  }

  function showRegion(chosen) {
    region = chosen;
    screen.frame(chosen);
    screen.element.scrollIntoView({ block: "nearest" });
    announce(`Showing columns ${chosen.x0} to ${chosen.x1 - 1}, rows ${chosen.y0} to ${chosen.y1 - 1}.`);
  }

  screen.element.setAttribute("aria-describedby", keys.id);
  screen.addEventListener("cursor", ({ detail: pixel }) => {
    readout.textContent = pixel ? `${pixel.x}, ${pixel.y}   ${blending.describe(pixel.x, pixel.y)}` : "";
    if (pixel && document.activeElement === screen.element) announce(readout.textContent);
  });
  addEventListener(
    "keydown",
    (event) => {
      if (
        event.key.toLowerCase() !== "f" ||
        event.ctrlKey ||
        event.metaKey ||
        event.altKey ||
        event.target.closest("input:not([type=range], [type=radio]), textarea")
      )
        return;
      modes.choose(blending.mode === "a" ? "b" : "a");
      announce(`Picture ${blending.mode.toUpperCase()}`);
    },
    { signal },
  );

  place.removeAttribute("aria-busy");
  place.replaceChildren(
    h(
      "div",
      { className: "compared" },
      h(
        "section",
        { className: "compared-pictures", "aria-label": "Pictures" },
        h("div", { className: "row tools" }, modes.element, display.element, makeZoom(screen)),
        screen.element,
        lineField,
        readout,
        legend,
        keys,
      ),
      h(
        "section",
        { className: "panel compared-verdict", "aria-label": "Verdict" },
        makeVerdict(answer, showRegion),
      ),
    ),
  );
  screen.fit();
  keepPlace(screen, signal);
  display.begin(asked);
  change("split");
  announce(answer.reason);
  return screen;
}

function makeModes(changed) {
  const inputs = Object.entries(MODES).map(([mode, name]) => [
    mode,
    name,
    h("input", {
      type: "radio",
      name: "compare-mode",
      value: mode,
      checked: mode === "split",
      onchange: () => changed(mode),
    }),
  ]);
  return {
    element: h(
      "fieldset",
      { className: "modes" },
      h("legend", {}, "Shown"),
      h(
        "div",
        { className: "row" },
        inputs.map(([, name, input]) => h("label", {}, input, ` ${name}`)),
      ),
    ),
    get chosen() {
      return inputs.find(([, , input]) => input.checked)[0];
    },
    choose(wanted) {
      for (const [mode, , input] of inputs) input.checked = mode === wanted;
      changed(wanted);
    },
  };
}
