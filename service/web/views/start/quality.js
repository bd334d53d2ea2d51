// How well the picture is to be rendered: as the scene says, by samples, to an error, or for a time.

import { h } from "../../dom.js";
import { STEP, digits } from "../../format.js";

const PATTERNS = ["uniform", "rotated", "random", "stratified", "sobol", "center"];
const LIGHT_PATTERNS = ["uniform", "random", "stratified", "sobol"];
const MODES = [
  ["scene", "As written"],
  ["samples", "Samples"],
  ["error", "Target error"],
  ["time", "Time"],
];
// The least error that the service takes.
const LEAST_ERROR = 1e-6;
// What is asked for within a time as long as no quote says what can be reached: a quarter of a step of 8 bits.
const HOPED = STEP / 4;

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
    ],
    error: () => [
      number("steps", "Error, in steps of 8 bits", { min: 0.01, max: 255, step: "any" }),
      h(
        "p",
        { className: "soft small" },
        "Samples go where the picture needs them, until its error is this small. One step is 1/255 of white: hardly anybody sees less.",
      ),
    ],
    time: () => [
      number("seconds", "Seconds", { min: 0.1, max: 86400, step: "any" }),
      h(
        "p",
        { className: "soft small" },
        "Samples go where they help most until the time is over; the job tells the error that was reached.",
      ),
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
  samples: ({ pattern, samples, lightPattern, lightSamples }) => ({
    mode: "fixed",
    antialiasing: { pattern, samples },
    light: { pattern: lightPattern, samples: lightSamples },
  }),
  error: ({ steps }) => ({ mode: "target", error: Math.min(1, Math.max(LEAST_ERROR, steps * STEP)) }),
  time: ({ seconds }) => ({ mode: "target", error: HOPED, time_limit: seconds }),
};

function stateOf(quality) {
  if (quality === null) return { mode: "scene" };
  if (quality.mode === "target") {
    return quality.time_limit
      ? { mode: "time", seconds: quality.time_limit }
      : { mode: "error", steps: Number(digits(quality.error / STEP, 3)) };
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
