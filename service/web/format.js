// Numbers and times as people read them.

/** Seconds, two digits of them: 0.42 s, 3.1 s, 2 min 10 s, 1 h 5 min. */
export function seconds(value) {
  if (value < 10) return `${digits(value)} s`;
  if (value < 99.5) return `${Math.round(value)} s`;
  if (value < 5970)
    return `${Math.floor(value / 60)} min ${Math.round(value % 60)} s`.replace(/ 60 s$/, " 59 s");
  return `${Math.floor(value / 3600)} h ${Math.floor((value % 3600) / 60)} min`;
}

/** Two significant digits, without an exponent where people do without one. */
export function digits(value, count = 2) {
  if (value === 0) return "0";
  if (Math.abs(value) < 1e-4 || Math.abs(value) >= 1e6) return value.toExponential(count - 1);
  const places = Math.max(0, count - 1 - Math.floor(Math.log10(Math.abs(value))));
  return value.toFixed(Math.min(places, 20));
}

/** A whole number in groups of three, or short: 940, 12,400, 3.1 million. */
export function count(value) {
  if (value < 1e6) return value.toLocaleString("en");
  if (value < 1e9) return `${digits(value / 1e6, value < 1e7 ? 2 : 3)} million`;
  return `${digits(value / 1e9, value < 1e10 ? 2 : 3)} billion`;
}

/** An error, as steps of a picture of 8 bits: what people can see. */
export const STEP = 1 / 255;

export function steps(error) {
  return `${digits(error / STEP)}`;
}

/** A quality in a few words. */
export function qualityName(quality) {
  const { mode, precision, error, confidence, time_limit: limit, antialiasing, light } = quality;
  const words =
    mode === "target"
      ? [
          `target error of ${steps(error)} steps`,
          confidence !== USUAL_CONFIDENCE && `in ${digits(100 * confidence, 3)} of 100 pictures`,
          limit && `within ${seconds(limit)}`,
        ]
      : [`${antialiasing.samples} × ${antialiasing.pattern}`, `light ${light.samples} × ${light.pattern}`];
  return [...words, precision === "double" && "double precision"].filter(Boolean).join(", ");
}

/** Share of pictures that keep their target error, unless another is asked for. */
export const USUAL_CONFIDENCE = 0.95;

export const percent = (share) => `${Math.round(100 * share)} %`;

export function bytes(value) {
  if (value < 1000) return `${value} bytes`;
  return value < 1e6 ? `${digits(value / 1e3, 3)} kB` : `${digits(value / 1e6, 3)} MB`;
}

/** How long ago a moment was. */
export function ago(moment, now = Date.now()) {
  const passed = Math.max(0, (now - Date.parse(moment)) / 1000);
  if (passed < 45) return "just now";
  const units = [
    [60, "minute"],
    [3600, "hour"],
    [86400, "day"],
  ];
  const [size, name] = units.findLast(([size]) => passed >= size * 0.9) ?? units[0];
  const number = Math.max(1, Math.round(passed / size));
  return `${number} ${name}${number > 1 ? "s" : ""} ago`;
}
