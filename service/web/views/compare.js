// Compares two pictures: split along a line, in turn, by their difference, and by the verdict of the service.

import { Problem, get, jobPath, messageOf, post } from "../api.js";
import { announce, h } from "../dom.js";
import { field } from "../elements.js";
import { Blending, MODES } from "./compare/blending.js";
import { HOTTEST, metricsOf } from "./compare/differences.js";
import { encoded, filmOfFile, filmOfJob, referenceIn } from "./compare/pictures.js";
import { EIGHT_BITS } from "./compare/references.js";
import { makeNumbers, makeVerdict } from "./compare/verdict.js";
import { displayOf, makeDisplay, makeZoom } from "./picture/controls.js";
import { MOVING_KEYS } from "./picture/keys.js";
import { makeScale } from "./picture/legend.js";
import { keepPlace } from "./picture/place.js";
import { leastPositive } from "./picture/scales.js";
import { Screen } from "./picture/screen.js";
import { catchLine, hearSpace } from "./picture/split.js";

export const title = "Compare";

/** @import { Film } from "./picture/film.js" */
/** @import { Encoding } from "./compare/references.js" */
/** @typedef {{film: Film, note: string}} Read A picture, and what to know of it. */

/** What the scales of the modes are about. @type {Record<string, string>} */
const LEGENDS = {
  difference: "The largest difference of the channels, linear. Grey is infinite or has no value.",
  relative: "The largest |A − B| / √(B² + 0.01) of the channels, linear. Grey is infinite or has no value.",
};
const HEAT_LEGEND = () =>
  h("p", { className: "soft small legend" }, `The displayed difference, from black to white at ${HOTTEST}.`);

// Instead of a job's id: a file still to be chosen.
const FILE = "file";

/** @param {HTMLElement} root @param {ViewParams} params */
export function mount(root, { a, b }) {
  const life = new AbortController();
  const { signal } = life;
  const names = h("p", { className: "lead" });
  const place = h("div", { "aria-busy": "true" });
  root.append(h("h1", {}, "Compare"), names, place);
  let close = () => {};

  /** @param {unknown} error */
  function fail(error) {
    if (signal.aborted) return;
    place.removeAttribute("aria-busy");
    place.append(refusalOf(error));
  }

  /**
   * Show both pictures as soon as they are here, and the verdict of the service when it has come.
   *
   * @param {object} reference - For the service.
   * @param {Promise<Read | null>} other - B, null if only the service can read it.
   */
  async function compare(reference, other) {
    place.replaceChildren(h("p", { className: "soft", role: "status" }, "Comparing …"));
    /** @type {[Film, JobRequestDocument, Read | null]} */
    const [film, { scene }, read] = await Promise.all([
      filmOfJob(a, signal),
      get(`${jobPath(a)}/request`, { signal }),
      other,
    ]);
    /** @type {Promise<ComparisonDocument>} */
    const asking = post(
      "/v1/comparisons",
      { image: { job: a }, reference, pictures: read === null },
      { signal },
    );
    const same = read && read.film.width === film.width && read.film.height === film.height;
    const b = same ? read : await readByService(await asking, film);
    signal.throwIfAborted();
    const shown = show(place, [film, b.film], b.note, displayOf(scene), signal);
    close = shown.close;
    await asking.then(shown.conclude, shown.refuse);
  }

  async function begin() {
    /** @type {JobDocument} */
    const job = await get(jobPath(a), { signal });
    const link = (/** @type {JobDocument} */ one) =>
      h("a", { href: `/jobs/${one.id}` }, one.name ?? "an untitled scene");
    if (b === FILE) {
      names.append("A is ", link(job), ", B a file of your own.");
      const form = picker((file, encoding) =>
        chosen(file, encoding).catch((error) => (place.replaceChildren(form), fail(error))),
      );
      place.replaceChildren(form);
      return;
    }
    /** @type {JobDocument} */
    const other = await get(jobPath(b), { signal });
    names.append("A is ", link(job), ", B is ", link(other), ".");
    await compare(
      { job: b },
      filmOfJob(b, signal).then((film) => ({ film, note: "" })),
    );
  }

  /** @param {File} file @param {Encoding} encoding */
  async function chosen(file, encoding) {
    const reference = { content: await encoded(file), ...(encoding && { encoding }) };
    await compare(reference, filmOfFile(file, encoding));
  }

  begin().catch(fail);
  return () => {
    life.abort();
    close();
  };
}

/** What is wrong, without places in a request that the user did not write. @param {unknown} error */
function refusalOf(error) {
  const details = error instanceof Problem ? error.errors.map(({ detail }) => detail) : [];
  const text = details.length ? details.join(" ") : messageOf(error);
  return h("p", { className: "problem", role: "alert" }, text);
}

/**
 * B as the service has read it, which sends it with 8 bits a channel.
 *
 * @param {ComparisonDocument} answer
 * @param {Film} film - A.
 * @returns {Promise<Read>}
 */
async function readByService({ images }, { width, height }) {
  if (!images) throw new Error("The service sent no pictures.");
  return { film: await referenceIn(images.side_by_side, width, height), note: EIGHT_BITS };
}

/** @param {(file: File, encoding: Encoding) => void} chosen */
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
  const submit = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    if (file.files?.[0]) chosen(file.files[0], /** @type {Encoding} */ (encoding.value));
  };
  return h(
    "form",
    { className: "panel row reference", onsubmit: submit },
    field("Reference: a PNG, NPY or EXR file", file),
    field("Its values are", encoding),
    h("button", { type: "submit", className: "primary" }, "Compare"),
  );
}

/**
 * @param {HTMLElement} place
 * @param {[Film, Film]} films - A and B.
 * @param {string} note - What to know of B.
 * @param {DisplaySettings} asked
 * @param {AbortSignal} signal
 */
function show(place, films, note, asked, signal) {
  const [{ width, height, whole }] = films;
  /** @type {ComparedRegion | null} */
  let region = null;
  const screen = new Screen({
    width,
    height,
    label: `Pictures A and B, ${width} by ${height} pixels`,
    overlay,
  });
  const blending = new Blending(screen, films);
  const display = makeDisplay(() => blending.expose(display.exposure, display.transfer), "compare");
  const legend = h("div");
  const readout = h("p", { className: "readout number" });
  const keys = h(
    "p",
    { className: "soft small", id: "compare-keys" },
    `Hold Space for B; F switches between A and B. ${MOVING_KEYS}`,
  );
  /** @type {HTMLInputElement} */
  const line = h("input", {
    id: "split-line",
    type: "range",
    min: 0,
    max: 100,
    step: 0.5,
    value: 50,
    oninput: () => blending.split(Number(line.value) / 100),
  });
  catchLine(screen, {
    at: () => (blending.mode === "split" ? blending.at : null),
    move: (share) => {
      line.value = String(100 * share);
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
  const numbers = makeNumbers(metricsOf(...films, whole));
  const verdict = h(
    "section",
    { className: "panel compared-verdict", "aria-label": "Verdict", "aria-busy": "true" },
    h("p", { className: "soft", role: "status" }, "Comparing …"),
    numbers,
  );

  /** @param {CanvasRenderingContext2D} context */
  function overlay(context) {
    blending.overlay(context);
    if (region) screen.outline(context, region, "#ffb43c");
  }

  /** @param {string} mode */
  function change(mode) {
    blending.show(mode);
    lineField.hidden = mode !== "split";
    legend.replaceChildren(mode in LEGENDS ? scaleOf(mode) : mode === "heat" ? HEAT_LEGEND() : "");
  }

  /** @param {string} mode */
  function scaleOf(mode) {
    const least = leastPositive(blending.apart(mode));
    return makeScale(blending.scales[mode], least, LEGENDS[mode], (scale) => {
      blending.scales[mode] = scale;
      blending.draw();
    });
  }

  /** @param {ComparisonDocument} answer */
  function conclude(answer) {
    verdict.removeAttribute("aria-busy");
    verdict.replaceChildren(makeVerdict(answer, showRegion));
    announce(answer.reason);
  }

  /** @param {unknown} error */
  function refuse(error) {
    if (signal.aborted) return;
    verdict.removeAttribute("aria-busy");
    verdict.replaceChildren(refusalOf(error), numbers);
  }

  /** @param {ComparedRegion} chosen */
  function showRegion(chosen) {
    region = chosen;
    screen.frame(chosen);
    screen.element.scrollIntoView({ block: "nearest" });
    announce(`Showing columns ${chosen.x0} to ${chosen.x1 - 1}, rows ${chosen.y0} to ${chosen.y1 - 1}.`);
  }

  screen.element.setAttribute("aria-describedby", keys.id);
  screen.on("cursor", (pixel) => {
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
        /** @type {Element} */ (event.target).closest("input:not([type=range], [type=radio]), textarea")
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
        { "aria-label": "Pictures" },
        h("div", { className: "row tools" }, modes.element, display.element, makeZoom(screen)),
        screen.element,
        lineField,
        readout,
        legend,
        h("p", { className: "soft small", hidden: !note }, note),
        keys,
      ),
      verdict,
    ),
  );
  screen.fit();
  keepPlace(screen, signal);
  display.begin(asked);
  change("split");
  return { conclude, refuse, close: () => (screen.close(), blending.close()) };
}

/** @param {(mode: string) => void} changed */
function makeModes(changed) {
  const inputs = Object.keys(MODES).map((mode) =>
    h("input", {
      type: "radio",
      name: "compare-mode",
      value: mode,
      checked: mode === "split",
      onchange: () => changed(mode),
    }),
  );
  return {
    element: h(
      "fieldset",
      { className: "modes" },
      h("legend", {}, "Shown"),
      h(
        "div",
        { className: "row" },
        inputs.map((input) => h("label", {}, input, ` ${MODES[input.value]}`)),
      ),
    ),
    get chosen() {
      return inputs.find((input) => input.checked)?.value ?? "split";
    },
    /** @param {string} wanted */
    choose(wanted) {
      for (const input of inputs) input.checked = input.value === wanted;
      changed(wanted);
    },
  };
}
