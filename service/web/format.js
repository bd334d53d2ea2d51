// Numbers and times for display.

/** A duration with two significant digits: 0.42 s, 3.1 s, 2 min 10 s, 1 h 5 min. @param {number} value */
export function seconds(value) {
  if (value < 10) return `${digits(value)} s`;
  if (value < 99.5) return `${Math.round(value)} s`;
  if (value < 5970)
    return `${Math.floor(value / 60)} min ${Math.round(value % 60)} s`.replace(/ 60 s$/, " 59 s");
  return `${Math.floor(value / 3600)} h ${Math.floor((value % 3600) / 60)} min`;
}

/** CPU time: 0.42 CPU s, 12,345 CPU s. @param {number} value */
export const cpuSeconds = (value) => `${value < 10 ? digits(value) : count(Math.round(value))} CPU s`;

/** Two significant digits, with an exponent only for very small and very large numbers. @param {number} value */
export function digits(value, count = 2) {
  if (value === 0) return "0";
  if (Math.abs(value) < 1e-4 || Math.abs(value) >= 1e6) return value.toExponential(count - 1);
  const places = Math.max(0, count - 1 - Math.floor(Math.log10(Math.abs(value))));
  return value.toFixed(Math.min(places, 20));
}

const LARGE = new Intl.NumberFormat("en", {
  notation: "compact",
  compactDisplay: "long",
  maximumSignificantDigits: 3,
});

/** A whole number: 940, 12,400, 3.14 million. @param {number} value */
export const count = (value) => (value < 1e6 ? value.toLocaleString("en") : LARGE.format(value));

/** A number with its noun: 1 file, 2 files. @param {number} number @param {string} noun */
export const plural = (number, noun, many = `${noun}s`) => `${count(number)} ${number === 1 ? noun : many}`;

/** One code value of an 8-bit image, as a linear error. */
export const CODE_VALUE = 1 / 255;

/** An error in code values. @param {number} error */
export function codeValues(error) {
  return digits(error / CODE_VALUE);
}

/** A quality in a few words. @param {ResolvedQuality} quality */
export function qualityName(quality) {
  const words = quality.mode === "target" ? targetWords(quality) : fixedWords(quality);
  return [...words, quality.precision === "double" && "double precision"].filter(Boolean).join(", ");
}

/** @param {ResolvedTarget} quality */
const targetWords = ({ error, confidence, time_limit: limit }) => [
  `target error of ${codeValues(error)} code values`,
  confidence !== USUAL_CONFIDENCE && `${digits(100 * confidence, 3)} % confidence`,
  limit && `within ${seconds(limit)}`,
];

/** @param {ResolvedFixed} quality */
const fixedWords = ({ antialiasing, light }) => [
  `${antialiasing.samples} × ${antialiasing.pattern}`,
  `light ${light.samples} × ${light.pattern}`,
];

/** The confidence of a target error by default. */
export const USUAL_CONFIDENCE = 0.95;

/** A share per cent, on one line. @param {number} share @param {number} [places] - Decimal ones. */
export const percent = (share, places = 0) => `${(100 * share).toFixed(places)}\u00a0%`;

/** @param {number} value */
export function bytes(value) {
  if (value < 1000) return `${value} bytes`;
  return value < 1e6 ? `${digits(value / 1e3, 3)} kB` : `${digits(value / 1e6, 3)} MB`;
}

const TIMES = new Intl.RelativeTimeFormat("en");

/** How long ago a time was. @param {string} time */
export function ago(time, now = Date.now()) {
  const passed = Math.max(0, (now - Date.parse(time)) / 1000);
  if (passed < 45) return "just now";
  /** @type {[number, Intl.RelativeTimeFormatUnit][]} */
  const units = [
    [60, "minute"],
    [3600, "hour"],
    [86400, "day"],
  ];
  const [size, name] = units.findLast(([size]) => passed >= size * 0.9) ?? units[0];
  return TIMES.format(-Math.max(1, Math.round(passed / size)), name);
}
