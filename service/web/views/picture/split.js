// The line between two pictures, dragged on the picture, and the key that shows the second one alone.

// CSS pixels beside the line at which it is still caught, and the size of its handle.
const REACH = 12;
const HANDLE = 9;

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

/**
 * Draw the handle of a line that can be dragged.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {number} x
 * @param {number} height
 */
export function drawHandle(context, x, height) {
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
