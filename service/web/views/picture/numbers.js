// Numbers inside pixels, once they are large enough to hold them.

import { luma } from "./transfer.js";

// CSS pixels a side from which three lines of linear value and code are readable.
const READABLE = 64;
const LINES_A_PIXEL = 6.4;
const LARGEST_TEXT = 14;
// From this luminance on, black text is easier to read than white.
const BRIGHT = 118;

/**
 * @param {CanvasRenderingContext2D} context
 * @param {PictureScreen} screen
 * @param {(x: number, y: number) => string[] | null} lines - The text in a pixel.
 * @param {(x: number, y: number) => number[]} shown - Its codes.
 * @returns {void}
 */
export function drawNumbers(context, screen, lines, shown) {
  const { scale, left, top, element } = screen;
  if (scale < READABLE) return;
  const size = Math.min(LARGEST_TEXT, scale / LINES_A_PIXEL);
  context.font = `${size}px ${getComputedStyle(element).getPropertyValue("--mono")}`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  const { x0, y0, x1, y1 } = screen.visible();
  for (let y = y0; y < y1; y++) {
    for (let x = x0; x < x1; x++) {
      const texts = lines(x, y);
      if (!texts) continue;
      const [red, green, blue] = shown(x, y);
      context.fillStyle = luma(red, green, blue) > BRIGHT ? "#000" : "#fff";
      const middle = top + scale * (y + 0.5) - ((texts.length - 1) * size * 1.25) / 2;
      texts.forEach((text, i) =>
        context.fillText(text, left + scale * (x + 0.5), middle + i * size * 1.25, scale - 4),
      );
    }
  }
}

/** A difference; that of two equal infinities is 0. @param {number} one @param {number} other */
export const minus = (one, other) => (one === other ? 0 : one - other);

/** A number with at most four digits. @param {number} value */
export function short(value) {
  if (Number.isNaN(value)) return "NaN";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (Number.isInteger(value) && Math.abs(value) < 1e6) return String(value).replace("-", "−");
  const size = Math.abs(value);
  const text = size >= 1e5 || size < 1e-4 ? value.toExponential(2) : value.toPrecision(4);
  return text
    .replace("-", "−")
    .replace(/(\.\d*?)0+$/, "$1")
    .replace(/\.$/, "");
}
