// The labels of a job, written as one text.

import { h } from "../../dom.js";
import { field } from "../../elements.js";
import { pointerParts } from "../../json_text.js";

/** @param {() => void} onInput */
export function makeLabels(onInput) {
  const message = h("p", { id: "labels-problem", className: "field-problem", role: "alert", hidden: true });
  const input = h("input", {
    id: "labels",
    type: "text",
    oninput: () => (refuse([]), onInput()),
    placeholder: "course:graphics, week:3",
    autocomplete: "off",
    spellcheck: false,
    "aria-describedby": message.id,
  });

  /** Show what the service says about labels. @param {ProblemEntry[]} problems @returns {boolean} Whether there is something. */
  function refuse(problems) {
    const texts = problems
      .filter(({ pointer }) => /^\/labels(\/|$)/.test(pointer))
      .map(({ pointer, detail }) => {
        const name = pointerParts(pointer)[1];
        return name === undefined ? `Labels: ${detail}` : `Label "${name}": ${detail}`;
      });
    message.textContent = texts.join(" ");
    message.hidden = texts.length === 0;
    input.setAttribute("aria-invalid", String(!message.hidden));
    if (!message.hidden) input.focus();
    return !message.hidden;
  }

  /** Names and values in their order. @returns {[string, string][]} */
  const pairs = () =>
    input.value
      .split(",")
      .map((part) => part.trim())
      .filter(Boolean)
      .map((part) => part.split(/:(.*)/s, 2))
      .map(([name, value = ""]) => [name.trim(), value.trim()]);

  return {
    element: field("Labels to find the job by", input, message),
    refuse,
    /** Whether no name is written twice, of which an object would keep one value. */
    check() {
      const names = pairs().map(([name]) => name);
      const twice = names.find((name, i) => names.indexOf(name) < i);
      const detail = "It has two values. Give it one.";
      return !refuse(twice === undefined ? [] : [{ pointer: `/labels/${twice}`, detail }]);
    },
    get text() {
      return input.value;
    },
    set text(text) {
      input.value = text;
      refuse([]);
    },
    /** Labels as an object, or null if there are none. */
    get value() {
      return input.value.trim() ? Object.fromEntries(pairs()) : null;
    },
  };
}
