// How well the picture is to be rendered: as the scene says, by samples, to an error, or for a time.

import { h } from "../../dom.js";
import { STEP, USUAL_CONFIDENCE, digits } from "../../format.js";

const PATTERNS = ["uniform", "rotated", "random", "stratified", "sobol", "center"];
const LIGHT_PATTERNS = ["uniform", "random", "stratified", "sobol"];
const MODES = [
  ["scene", "As written"],
  ["samples", "Samples"],
  ["error", "Target error"],
  ["time", "Time"],
];
const PRECISIONS = ["single", "double"];
// The least error that the service takes.
const LEAST_ERROR = 1e-6;
// What is asked for within a time as long as no quote says what can be reached: a quarter of a step of 8 bits.
const HOPED = STEP / 4;

// What few people change.
const USUAL = { percent: 100 * USUAL_CONFIDENCE, precision: "single" };

/** @param {(focus?: boolean) => void} onChange */
export function makeQuality(onChange) {
  const state = {
    mode: "scene",
    pattern: "sobol",
    samples: 16,
    lightPattern: "sobol",
    lightSamples: 16,
    steps: 1,
    seconds: 5,
    ...USUAL,
  };
  const fields = h("div", { className: "quality-fields" });
  const choices = MODES.map(([mode, name]) => choice(mode, name));
  const element = h(
    "fieldset",
    { className: "quality" },
    h("legend", {}, "Quality"),
    h("div", { className: "segments" }, choices),
    fields,
  );

  function choice(mode, name) {
    const radio = h("input", {
      type: "radio",
      name: "quality",
      value: mode,
      checked: mode === state.mode,
      onchange: () => select(mode),
    });
    return h("label", {}, radio, h("span", {}, name));
  }

  function select(mode) {
    state.mode = mode;
    render();
    onChange();
  }

  function set(key, value) {
    state[key] = value;
    onChange();
  }

  function number(key, label, { min, max, step }) {
    const input = h("input", {
      type: "number",
      min,
      max,
      step,
      value: state[key],
      inputMode: "decimal",
      required: true,
    });
    input.addEventListener("input", () => input.value !== "" && set(key, input.valueAsNumber));
    return h("label", { className: "field" }, h("span", { className: "label" }, label), input);
  }

  function list(key, label, names) {
    const select = h(
      "select",
      { onchange: () => set(key, select.value) },
      names.map((name) => h("option", { value: name, selected: name === state[key] }, name)),
    );
    return h("label", { className: "field" }, h("span", { className: "label" }, label), select);
  }

  const confidence = () =>
    number("percent", "Of 100 pictures, keep the error", { min: 50, max: 99.999, step: "any" });
  const arithmetic = () => list("precision", "Arithmetic", PRECISIONS);

  /** Fields that are shown at once only where something unusual stands in them. */
  function more(...inner) {
    const open = Object.entries(USUAL).some(([key, value]) => state[key] !== value);
    return h("details", { className: "more", open }, h("summary", {}, "More"), h("div", { className: "quality-fields" }, inner));
  }

  const FIELDS = {
    scene: () => [
      h(
        "p",
        { className: "soft small" },
        "The patterns and samples under ",
        h("code", {}, "sampling"),
        " in the scene.",
      ),
    ],
    samples: () => [
      number("samples", "Samples a pixel", { min: 1, max: 4096, step: 1 }),
      list("pattern", "Pattern in the pixel", PATTERNS),
      number("lightSamples", "Points a light", { min: 1, max: 4096, step: 1 }),
      list("lightPattern", "Pattern on the light", LIGHT_PATTERNS),
      more(arithmetic()),
    ],
    error: () => [
      number("steps", "Error, in steps of 8 bits", { min: 0.01, max: 255, step: "any" }),
      h(
        "p",
        { className: "soft small" },
        "Samples go where the picture needs them, until its error is this small. One step is 1/255 of white: hardly anybody sees less.",
      ),
      more(confidence(), arithmetic()),
    ],
    time: () => [
      number("seconds", "Seconds", { min: 0.1, max: 86400, step: "any" }),
      h(
        "p",
        { className: "soft small" },
        "Samples go where they help most until the time is over; the job tells the error that was reached.",
      ),
      more(confidence(), arithmetic()),
    ],
  };

  function render() {
    fields.replaceChildren(...FIELDS[state.mode]());
    for (const label of choices) label.firstChild.checked = label.firstChild.value === state.mode;
  }

  render();
  return {
    element,
    get value() {
      return VALUES[state.mode](state);
    },
    /** An offer of the service with what was asked for beside it. */
    kept: (offer) => ({ ...offer, ...unusual(state, offer.mode) }),
    /** The time that may be taken, seconds; null where something else was asked for. */
    get limit() {
      return state.mode === "time" ? state.seconds : null;
    },
    set value(quality) {
      Object.assign(state, stateOf(quality));
      render();
      onChange();
    },
  };
}

const VALUES = {
  scene: () => null,
  samples: ({ pattern, samples, lightPattern, lightSamples, ...rest }) => ({
    mode: "fixed",
    antialiasing: { pattern, samples },
    light: { pattern: lightPattern, samples: lightSamples },
    ...unusual(rest, "fixed"),
  }),
  error: ({ steps, ...rest }) => ({
    mode: "target",
    error: Math.min(1, Math.max(LEAST_ERROR, steps * STEP)),
    ...unusual(rest, "target"),
  }),
  time: ({ seconds, ...rest }) => ({
    mode: "target",
    error: HOPED,
    time_limit: seconds,
    ...unusual(rest, "target"),
  }),
};

/** What was chosen of that which few people change. */
function unusual({ percent, precision }, mode) {
  return {
    ...(mode === "target" && percent !== USUAL.percent && { confidence: Number(digits(percent / 100, 6)) }),
    ...(precision !== USUAL.precision && { precision }),
  };
}

function stateOf(quality) {
  if (quality === null) return { mode: "scene", ...USUAL };
  return { ...modeOf(quality), ...chosenOf(quality) };
}

function chosenOf({ confidence = USUAL_CONFIDENCE, precision = USUAL.precision }) {
  return { percent: Number(digits(100 * confidence, 6)), precision };
}

function modeOf(quality) {
  if (quality.mode === "target") {
    return quality.time_limit
      ? { mode: "time", seconds: quality.time_limit }
      : { mode: "error", steps: Number(digits(quality.error / STEP, 6)) };
  }
  const { antialiasing, light } = quality;
  if (!antialiasing || !light) return { mode: "scene" };
  return {
    mode: "samples",
    pattern: antialiasing.pattern,
    samples: antialiasing.samples,
    lightPattern: light.pattern,
    lightSamples: light.samples,
  };
}
