// The result of a comparison, in words and numbers.

import { h } from "../../dom.js";
import { short } from "../picture/numbers.js";

const VERDICTS = {
  match: ["✓", "The same", "good"],
  noisy_match: ["✓", "The same except for noise", "good"],
  mismatch: ["✕", "Not the same", "bad"],
};
/** @type {[string, string, string][]} */
const METRICS = [
  ["rmse", "RMSE", "root mean square difference, linear, clipped to 0..1"],
  ["psnr", "PSNR, dB", "of the same difference"],
  ["max_abs", "Largest difference", "in any channel"],
  ["frac_over", "Pixels that differ", "share, by more than the limit"],
  ["bias_blocks", "Biased blocks", "share, brighter or darker than noise allows"],
  ["ssim", "SSIM", "structural similarity as displayed"],
];

/** The verdict and its reason. @param {ComparisonDocument} answer */
export function makeVerdict({ verdict, reason }) {
  const [mark, word, kind] = VERDICTS[verdict];
  const sign = h("span", { "aria-hidden": "true" }, `${mark} `);
  return h("div", {}, h("h2", { className: `verdict ${kind}` }, sign, word), h("p", {}, reason));
}

/** Probable mistakes, worst regions and metrics. @param {ComparisonDocument} answer @param {(region: ComparedRegion) => void} showRegion */
export function makeDetails({ diagnosis: causes, worst_regions: worst, metrics }, showRegion) {
  return h(
    "div",
    {},
    causes.length ? diagnosis(causes) : "",
    worst.length ? regions(worst, showRegion) : "",
    makeNumbers(metrics),
  );
}

/** @param {ComparisonDocument["diagnosis"]} causes */
function diagnosis(causes) {
  const entry = (
    /** @type {ComparisonDocument["diagnosis"][0]} */ { cause, hint, rmse_before: before, rmse_after: after },
  ) =>
    h(
      "li",
      {},
      h("strong", {}, cause.replaceAll("_", " ")),
      h("p", {}, hint),
      h(
        "p",
        { className: "soft small" },
        `With it undone, the RMSE falls from ${short(before)} to ${short(after)}.`,
      ),
    );
  return h("div", {}, h("h3", {}, "Probable mistake"), h("ul", { className: "causes" }, causes.map(entry)));
}

/** @param {ComparedRegion[]} worst @param {(region: ComparedRegion) => void} showRegion */
function regions(worst, showRegion) {
  const entry = (/** @type {ComparedRegion} */ region, /** @type {number} */ i) => {
    const { x0, y0, x1, y1, share, rmse, brightness, name } = region;
    const place = `columns ${x0} to ${x1 - 1}, rows ${y0} to ${y1 - 1}`;
    const button = h(
      "button",
      { type: "button", onclick: () => showRegion(region) },
      `Region ${i + 1}${name ? `: ${name}` : ""}`,
    );
    const kind = brightness > 0 ? "too bright" : "too dark";
    return h(
      "li",
      {},
      button,
      h(
        "p",
        { className: "soft small" },
        `${place}; ${Math.round(100 * share)} % of the squared difference; RMSE ${short(rmse)}; ${kind} by ${short(Math.abs(brightness))}`,
      ),
    );
  };
  return h("div", {}, h("h3", {}, "Worst regions"), h("ol", { className: "regions" }, worst.map(entry)));
}

/** @param {number | null} value */
const shown = (value) => (value === null ? "–" : short(value));

/** A table of those metrics that are there. @param {Record<string, number | null>} values */
export function makeNumbers(values) {
  const row = (/** @type {[string, string, string]} */ [key, name, what]) =>
    h(
      "tr",
      {},
      h("th", { scope: "row" }, name, h("span", { className: "soft small" }, ` ${what}`)),
      h("td", { className: "number" }, shown(values[key])),
    );
  return h(
    "div",
    {},
    h("h3", {}, "Numbers"),
    h("table", { className: "metrics" }, h("tbody", {}, METRICS.filter(([key]) => key in values).map(row))),
  );
}
