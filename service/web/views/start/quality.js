// The quality of the picture: as in the scene, by samples, by a target error, or by a time limit.

import { h } from "../../dom.js";
import { field } from "../../elements.js";
import { CODE_VALUE, USUAL_CONFIDENCE, digits } from "../../format.js";

/** @typedef {"scene" | "samples" | "error" | "time"} Mode */

/**
 * @typedef {object} State
 * @property {Mode} mode
 * @property {string} pattern
 * @property {number} samples
 * @property {string} lightPattern
 * @property {number} lightSamples
 * @property {number} codeValues - The target error.
 * @property {number} target - The target error under a time limit.
 * @property {number} seconds
 * @property {number} percent - The confidence.
 * @property {string} precision
 * @property {boolean} camera - Whether the samples per pixel are chosen here; the scene's else.
 * @property {boolean} light - The same of samples per light.
 */

/** @typedef {"samples" | "lightSamples" | "codeValues" | "seconds" | "percent"} NumberKey */
/** @typedef {"pattern" | "lightPattern" | "precision"} ListKey */
/** @typedef {{control: HTMLInputElement | HTMLSelectElement, label: string, message: HTMLElement}} Field */

/** Where a request has each value. @type {Record<NumberKey | ListKey, string>} */
const POINTERS = {
  samples: "quality/antialiasing/samples",
  pattern: "quality/antialiasing/pattern",
  lightSamples: "quality/light/samples",
  lightPattern: "quality/light/pattern",
  codeValues: "quality/error",
  seconds: "quality/time_limit",
  percent: "quality/confidence",
  precision: "quality/precision",
};
// Grids of as many rows as columns.
const SQUARE = ["uniform", "rotated"];

const PATTERNS = ["uniform", "rotated", "random", "stratified", "sobol", "center"];
const LIGHT_PATTERNS = ["uniform", "random", "stratified", "sobol"];
/** @type {[Mode, string][]} */
const MODES = [
  ["scene", "As written"],
  ["samples", "Samples"],
  ["error", "Target error"],
  ["time", "Time"],
];
const PRECISIONS = ["single", "double"];
// The target error for a time limit until a quote predicts one: a quarter of a code value.
const DEFAULT_TARGET = CODE_VALUE / 4;

// Defaults that few people change.
const USUAL = {
  percent: 100 * USUAL_CONFIDENCE,
  precision: "single",
  target: DEFAULT_TARGET,
  camera: true,
  light: true,
};

/** @param {(focus?: boolean) => void} onChange */
export function makeQuality(onChange) {
  /** @type {State} */
  const state = {
    mode: "scene",
    pattern: "sobol",
    samples: 16,
    lightPattern: "sobol",
    lightSamples: 16,
    codeValues: 1,
    seconds: 5,
    ...USUAL,
  };
  // What was given stays as it is until it is changed here.
  /** @type {QualityDocument | null} */
  let given = null;
  const fields = h("div", { className: "quality-fields" });
  // The fields that are shown, by their pointers.
  /** @type {Map<string, Field>} */
  const shown = new Map();
  const radios = MODES.map(([mode]) => radio(mode));
  const choices = MODES.map(([, name], i) => h("label", {}, radios[i], h("span", {}, name)));
  const element = h(
    "fieldset",
    { className: "quality" },
    h("legend", {}, "Quality"),
    h("div", { className: "segments" }, choices),
    fields,
  );

  /** @param {Mode} mode */
  function radio(mode) {
    const onchange = () => select(mode);
    return h("input", { type: "radio", name: "quality", value: mode, onchange });
  }

  /** @param {Mode} mode */
  function select(mode) {
    state.mode = mode;
    given = null;
    render();
    onChange();
  }

  /** @param {Partial<State>} part */
  function set(part) {
    Object.assign(state, part);
    given = null;
    say(mistakes());
    onChange();
  }

  /** @param {NumberKey} key @param {string} label @param {{min: number, max: number, step: number | "any"}} bounds */
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
    input.addEventListener("input", () => set(input.validity.valid ? { [key]: input.valueAsNumber } : {}));
    return shownField(key, label, input);
  }

  /** @param {NumberKey | ListKey} key @param {string} label @param {Field["control"]} control */
  function shownField(key, label, control) {
    const message = h("p", { id: `${key}-problem`, className: "field-problem", hidden: true });
    control.id = key;
    control.setAttribute("aria-describedby", message.id);
    shown.set(POINTERS[key], { control, label, message });
    return field(label, control, message);
  }

  /** What is wrong with the numbers that are written here; what was given is for the service to judge. @returns {ProblemEntry[]} */
  function mistakes() {
    /** @type {Record<string, string>} */
    const patterns = { samples: state.pattern, lightSamples: state.lightPattern };
    return Array.from(given ? [] : shown, ([pointer, { control }]) => ({
      pointer,
      detail: control instanceof HTMLInputElement ? mistakeIn(control, patterns[control.id]) : "",
    })).filter(({ detail }) => detail);
  }

  /** Show problems at their fields. @param {ProblemEntry[]} problems */
  function say(problems) {
    for (const [pointer, { control, message }] of shown) {
      const text = problems.find((problem) => problem.pointer === pointer)?.detail ?? "";
      message.textContent = text;
      message.hidden = !text;
      control.setAttribute("aria-invalid", String(text !== ""));
    }
  }

  /** @param {ListKey} key @param {string} label @param {string[]} names */
  function list(key, label, names) {
    /** @type {HTMLSelectElement} */
    const select = h(
      "select",
      { onchange: () => set({ [key]: select.value }) },
      names.map((name) => h("option", { value: name, selected: name === state[key] }, name)),
    );
    return shownField(key, label, select);
  }

  /** Fields of one sampling, or that it is the scene's. @param {"camera" | "light"} key @param {string} label @param {() => Node[]} inner */
  function chosenHere(key, label, inner) {
    if (state[key]) return inner();
    const choose = () => (set({ [key]: true }), render());
    const button = h("button", { type: "button", className: "plain", onclick: choose }, "Choose");
    return [h("p", { className: "soft small" }, `${label} as written in the scene. `, button)];
  }

  const confidence = () => number("percent", "Confidence (%)", { min: 50, max: 99.999, step: "any" });
  const arithmetic = () => list("precision", "Arithmetic", PRECISIONS);

  /** Fields that are collapsed while they have their default values. @param {Node[]} inner */
  function more(...inner) {
    const open = state.percent !== USUAL.percent || state.precision !== USUAL.precision;
    return h(
      "details",
      { className: "more", open },
      h("summary", {}, "More"),
      h("div", { className: "quality-fields" }, inner),
    );
  }

  /** @type {Record<Mode, () => Node[]>} */
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
      ...chosenHere("camera", "Samples per pixel", () => [
        number("samples", "Samples per pixel", { min: 1, max: 4096, step: 1 }),
        list("pattern", "Pattern in the pixel", PATTERNS),
      ]),
      ...chosenHere("light", "Samples per light", () => [
        number("lightSamples", "Samples per light", { min: 1, max: 4096, step: 1 }),
        list("lightPattern", "Pattern on the light", LIGHT_PATTERNS),
      ]),
      more(arithmetic()),
    ],
    error: () => [
      number("codeValues", "Error (code values of 255)", { min: 0.01, max: 255, step: "any" }),
      h(
        "p",
        { className: "soft small" },
        "Samples are added where the picture needs them until its error is this small. A difference of less than one code value is hardly visible.",
      ),
      more(confidence(), arithmetic()),
    ],
    time: () => [
      number("seconds", "Time limit (s)", { min: 0.1, max: 86400, step: "any" }),
      h(
        "p",
        { className: "soft small" },
        "Samples are added where they help most, for at most this long. The job then shows the error it reached.",
      ),
      more(confidence(), arithmetic()),
    ],
  };

  function render() {
    shown.clear();
    fields.replaceChildren(...FIELDS[state.mode]());
    say(mistakes());
    for (const one of radios) one.checked = one.value === state.mode;
  }

  render();
  return {
    element,
    /** @returns {QualityDocument | null} */
    get value() {
      return given ?? VALUES[state.mode](state);
    },
    get valid() {
      return mistakes().length === 0;
    },
    /** Show problems at their fields, those of numbers written here too. @param {ProblemEntry[]} problems @returns {ProblemEntry[]} All, with the names of fields. */
    explain(problems) {
      const all = [...problems, ...mistakes()];
      say(all);
      return all.map((problem) => {
        const label = shown.get(problem.pointer)?.label;
        return label ? { ...problem, detail: `${label}: ${problem.detail}` } : problem;
      });
    },
    focus: (/** @type {string} */ pointer) => (shown.get(pointer)?.control ?? radios[0]).focus(),
    /** An offer of the service, with the confidence and precision chosen here. @param {ResolvedQuality} offer */
    kept: (offer) => ({ ...offer, ...unusual(state, offer.mode) }),
    /** The time limit in seconds, for which the service chooses the error; null where an error is given. */
    get limit() {
      return state.mode === "time" && state.target === DEFAULT_TARGET ? state.seconds : null;
    },
    /** @param {QualityDocument | null} quality */
    set value(quality) {
      Object.assign(state, stateOf(quality));
      given = quality;
      render();
      onChange();
    },
  };
}

/** @param {HTMLInputElement} input @param {string | undefined} pattern - Of samples. */
function mistakeIn(input, pattern) {
  const { min, max, validity } = input;
  if (validity.rangeUnderflow || validity.rangeOverflow) return `Write a number from ${min} to ${max}.`;
  if (validity.stepMismatch) return "Write a whole number.";
  if (!validity.valid) return "Write a number.";
  const side = Math.sqrt(input.valueAsNumber);
  if (!pattern || !SQUARE.includes(pattern) || Number.isInteger(side)) return "";
  return `This pattern is a square grid: write ${Math.floor(side) ** 2} or ${Math.ceil(side) ** 2}.`;
}

/** @type {Record<Mode, (state: State) => QualityDocument | null>} */
const VALUES = {
  scene: () => null,
  samples: ({ pattern, samples, lightPattern, lightSamples, camera, light, ...rest }) => ({
    mode: "fixed",
    ...(camera && { antialiasing: { pattern, samples } }),
    ...(light && { light: { pattern: lightPattern, samples: lightSamples } }),
    ...unusual(rest, "fixed"),
  }),
  error: ({ codeValues, ...rest }) => ({
    mode: "target",
    error: codeValues / 255,
    ...unusual(rest, "target"),
  }),
  time: ({ seconds, target, ...rest }) => ({
    mode: "target",
    error: target,
    time_limit: seconds,
    ...unusual(rest, "target"),
  }),
};

/** The values that differ from their defaults. @param {Pick<State, "percent" | "precision">} state @param {QualityDocument["mode"]} mode */
function unusual({ percent, precision }, mode) {
  return {
    ...(mode === "target" && percent !== USUAL.percent && { confidence: Number(digits(percent / 100, 6)) }),
    ...(precision !== USUAL.precision && { precision }),
  };
}

/** @param {QualityDocument | null} quality @returns {Partial<State>} */
function stateOf(quality) {
  if (quality === null) return { mode: "scene", ...USUAL };
  const { precision = USUAL.precision } = quality;
  const confidence = (quality.mode === "target" && quality.confidence) || USUAL_CONFIDENCE;
  return { ...USUAL, ...modeOf(quality), percent: Number(digits(100 * confidence, 6)), precision };
}

/** @param {QualityDocument} quality @returns {Partial<State>} */
function modeOf(quality) {
  if (quality.mode === "target") {
    return quality.time_limit
      ? { mode: "time", seconds: quality.time_limit, target: quality.error }
      : { mode: "error", codeValues: Number(digits(quality.error / CODE_VALUE, 6)) };
  }
  const { antialiasing, light } = quality;
  return {
    mode: "samples",
    camera: Boolean(antialiasing),
    light: Boolean(light),
    ...(antialiasing && { pattern: antialiasing.pattern, samples: antialiasing.samples }),
    ...(light && { lightPattern: light.pattern, lightSamples: light.samples }),
  };
}
