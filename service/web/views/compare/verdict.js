// The result of a comparison, in words and numbers.

import { h } from "../../dom.js";
import { makeList, makeTable } from "../../elements.js";
import { cpuSeconds, percent, qualityName, seconds } from "../../format.js";
import { errorOf } from "../job/progress.js";
import { existedAlready, nameOf } from "../job/state.js";
import { short } from "../picture/numbers.js";
import { LIMIT } from "./differences.js";

/** @typedef {{job: JobDocument, scene: SceneDocument}} Side */
/**
 * @typedef {object} Places - What the picture shows of a result.
 * @property {PixelPlace | null} worst - The pixel with the largest difference.
 * @property {(pixel: PixelPlace) => void} showPixel
 * @property {(region: ComparedRegion) => void} showRegion
 */

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
  ["frac_over", "Pixels that differ", `share, by more than ${LIMIT}, linear`],
  ["bias_blocks", "Biased blocks", "share, brighter or darker than noise allows"],
  ["ssim", "SSIM", "structural similarity as displayed"],
];

/** The verdict and its reason. @param {ComparisonDocument} answer */
export function makeVerdict({ verdict, reason }) {
  const [mark, word, kind] = VERDICTS[verdict];
  const sign = h("span", { "aria-hidden": "true" }, `${mark} `);
  return h("div", h("h2", { className: `verdict ${kind}` }, sign, word), h("p", reason));
}

// Less of the squared difference is not worth a look where nothing but noise differs.
const LEAST_SHARE = 0.001;

/** Probable mistakes, worst regions and metrics. @param {ComparisonDocument} answer @param {Places} places */
export function makeDetails({ verdict, diagnosis: causes, worst_regions: regions, metrics }, places) {
  const worst = regions.filter(({ share }) => verdict === "mismatch" || share >= LEAST_SHARE);
  return h(
    "div",
    causes.length > 0 && h("h3", "Probable mistake"),
    makeList("ul.causes", causes, mistake),
    worst.length > 0 && h("h3", "Worst regions"),
    makeList("ol.regions", worst, (region, i) => [
      h(
        "button",
        { onclick: () => places.showRegion(region) },
        `Region ${i + 1}${region.name ? `: ${region.name}` : ""}`,
      ),
      h("p.soft.small", placeOf(region)),
    ]),
    makeNumbers(metrics, places),
  );
}

/** @param {ComparisonDocument["diagnosis"][0]} found */
const mistake = ({ cause, hint, rmse_before: before, rmse_after: after }) => [
  h("strong", cause.replaceAll("_", " ")),
  h("p", hint),
  h(
    "p.soft.small",
    after < before
      ? `With it undone, the RMSE falls from ${short(before)} to ${short(after)}.`
      : "It cannot be undone.",
  ),
];

/** @param {ComparedRegion} region */
function placeOf({ x0, y0, x1, y1, share, rmse, brightness }) {
  const place = `columns ${x0} to ${x1 - 1}, rows ${y0} to ${y1 - 1}`;
  const part = share < LEAST_SHARE ? `< ${percent(LEAST_SHARE, 1)}` : percent(share, share < 0.01 ? 1 : 0);
  const kind = `A ${brightness > 0 ? "brighter" : "darker"} than B by ${short(Math.abs(brightness))}`;
  return `${place}; ${part} of the squared difference; RMSE ${short(rmse)}; ${kind}`;
}

/** @param {number | null} value */
const shown = (value) => (value === null ? "–" : short(value));

/** A table of those metrics that are there. @param {Record<string, number | null>} values @param {Places} places */
export function makeNumbers(values, { worst, showPixel }) {
  const found =
    worst && h("button.plain", { onclick: () => showPixel(worst) }, `at pixel ${worst.x}, ${worst.y}`);
  const rows = METRICS.filter(([key]) => key in values).map(([key, name, what]) => [
    [name, h("span.soft.small", ` ${what}`, key === "max_abs" && found)],
    h("td.number", shown(values[key])),
  ]);
  return h("div", h("h3", "Numbers"), makeTable(".metrics", [], rows));
}

/** @type {[string, (job: JobDocument) => string | Node][]} */
const OF_JOBS = [
  ["Job", (job) => h("a", { href: `/jobs/${job.id}` }, nameOf(job))],
  ["Quality", ({ quality }) => qualityName(quality)],
  ["Time", (job) => (existedAlready(job) ? "existed already" : seconds(job.run_seconds ?? 0))],
  ["CPU time", ({ cost }) => cpuSeconds(cost.cpu_seconds)],
  ["Error", (job) => (job.error ? errorOf(job).join(", ") : "no estimate")],
];

/** Quality, time and error of two pictures beside each other. @param {Side} a @param {Side | null} b - Null for one that is no job. */
export function makeSides({ job: a }, b) {
  const rows = OF_JOBS.map(([name, of]) => [name, of(a), b ? of(b.job) : "–"]);
  return makeTable(".sides", ["", "A", "B"], rows);
}
