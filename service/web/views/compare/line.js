// The line between two pictures, dragged on the picture, and the key that shows the second one alone.

import { strokeCased } from "../picture/screen.js";

// CSS pixels beside the line at which it is still caught, and the size of its handle.
const REACH = 12;
const HANDLE = 9;
// CSS pixels between the line and the letters beside it.
const LABEL_GAP = 8;

/**
 * Catch the line of a screen. @param {PictureScreen} screen
 * @param {{at: () => number | null, move: (share: number) => void}} line - Its place as a share of the picture's width, or
 *   null while there is none.
 */
export function catchLine(screen, { at, move }) {
  const column = () => screen.left + screen.scale * screen.width * (at() ?? 0);
  screen.grip = {
    holds: ({ x }) => at() !== null && Math.abs(x - column()) <= REACH,
    drag: ({ x }) => move(Math.min(1, Math.max(0, (x - screen.left) / (screen.scale * screen.width)))),
  };
}

/** Draw the line, with a handle and the names of the pictures. @param {CanvasRenderingContext2D} context @param {PictureScreen} screen @param {number} column */
export function drawLine(context, screen, column) {
  const x = screen.left + screen.scale * column;
  const height = screen.element.clientHeight;
  context.beginPath();
  context.moveTo(x, 0);
  context.lineTo(x, height);
  strokeCased(context, "#fff");
  drawHandle(context, x, height);
  label(context, "A", x - LABEL_GAP, "right");
  label(context, "B", x + LABEL_GAP, "left");
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} height */
function drawHandle(context, x, height) {
  const y = height / 2;
  context.beginPath();
  context.arc(x, y, HANDLE, 0, 2 * Math.PI);
  Object.assign(context, { fillStyle: "#fff", strokeStyle: "#000", lineWidth: 1.5 });
  context.fill();
  context.stroke();
  context.beginPath();
  for (const side of [-1, 1]) {
    context.moveTo(x + 2 * side, y - 4);
    context.lineTo(x + 6 * side, y);
    context.lineTo(x + 2 * side, y + 4);
  }
  context.stroke();
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {string} letter
 * @param {number} x
 * @param {CanvasTextAlign} align
 */
function label(context, letter, x, align) {
  Object.assign(context, {
    font: "600 16px sans-serif",
    textAlign: align,
    textBaseline: "top",
    lineWidth: 3,
    strokeStyle: "#000",
    fillStyle: "#fff",
  });
  context.strokeText(letter, x, LABEL_GAP);
  context.fillText(letter, x, LABEL_GAP);
}

/**
 * Call `held(true)` while Space is held down, wherever no control takes it.
 *
 * @param {(down: boolean) => void} held
 * @param {AbortSignal} signal
 */
export function hearSpace(held, signal) {
  let down = false;
  const change = (/** @type {boolean} */ now) => now !== down && held((down = now));
  addEventListener(
    "keydown",
    (event) => {
      const target = /** @type {Element} */ (event.target);
      if (event.key !== " " || target.closest("input, select, textarea, button, summary, a")) return;
      // Else the page scrolls.
      event.preventDefault();
      change(true);
    },
    { signal },
  );
  addEventListener("keyup", (event) => event.key === " " && change(false), { signal });
  addEventListener("blur", () => change(false), { signal });
}
