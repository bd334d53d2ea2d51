// Two pictures beside each other: their quality, time and error.

import { h } from "../../dom.js";
import { cpuSeconds, qualityName, seconds } from "../../format.js";
import { errorOf } from "../job/progress.js";
import { existedAlready, nameOf } from "../job/state.js";

/** @typedef {{job: JobDocument, scene: SceneDocument}} Side */

/** @type {[string, (job: JobDocument) => string | Node][]} */
const ROWS = [
  ["Job", (job) => h("a", { href: `/jobs/${job.id}` }, nameOf(job))],
  ["Quality", ({ quality }) => qualityName(quality)],
  ["Time", (job) => (existedAlready(job) ? "existed already" : seconds(job.run_seconds ?? 0))],
  ["CPU time", ({ cost }) => cpuSeconds(cost.cpu_seconds)],
  ["Error", (job) => (job.error ? errorOf(job).join(", ") : "no estimate")],
];

/** @param {Side} a @param {Side | null} b - Null for one that is no job. */
export function makeSides({ job: a }, b) {
  const heads = ["", "A", "B"].map((name) => h("th", { scope: "col" }, name));
  const row = (/** @type {(typeof ROWS)[0]} */ [name, of]) =>
    h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, of(a)), h("td", {}, b ? of(b.job) : "–"));
  return h(
    "table",
    { className: "sides" },
    h("thead", {}, h("tr", {}, heads)),
    h("tbody", {}, ROWS.map(row)),
  );
}
