// What is drawn over a picture: tiles that fade in, brackets around those at work, and lines between pixels.

import { strokeCased } from "./screen.js";

// Tiles that arrive fade in over what was there before, for so long.
const LASTS_MS = 350;
// Snapshots cost memory and time: with more tiles at once, the picture changes at once.
const MOST = 24;

/** @param {PictureScreen} screen */
export function makeArrivals(screen) {
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  /** @type {{x0: number, y0: number, begun: number, old: OffscreenCanvas}[]} */
  let fading = [];

  return {
    /** Keep what the picture shows where tiles will be drawn. @param {PixelRectangle[]} tiles */
    before(tiles) {
      if (still.matches || document.hidden || tiles.length > MOST) return;
      const begun = performance.now();
      for (const tile of tiles)
        fading.push({ x0: tile.x0, y0: tile.y0, begun, old: piece(screen.canvas, tile) });
      fading = fading.slice(-2 * MOST);
    },
    /** @param {CanvasRenderingContext2D} context */
    draw(context) {
      const now = performance.now();
      fading = fading.filter(({ begun }) => now - begun < LASTS_MS);
      if (!fading.length) return;
      const { left, top, scale } = screen;
      context.imageSmoothingEnabled = scale * devicePixelRatio < 2;
      for (const { x0, y0, begun, old } of fading) {
        context.globalAlpha = 1 - (now - begun) / LASTS_MS;
        context.drawImage(old, left + scale * x0, top + scale * y0, scale * old.width, scale * old.height);
      }
      context.globalAlpha = 1;
      screen.redraw();
    },
  };
}

/** @param {HTMLCanvasElement} canvas @param {PixelRectangle} place */
function piece(canvas, { x0, y0, x1, y1 }) {
  const [width, height] = [Math.min(x1, canvas.width) - x0, Math.min(y1, canvas.height) - y0];
  const old = new OffscreenCanvas(Math.max(1, width), Math.max(1, height));
  const context = /** @type {OffscreenCanvasRenderingContext2D} */ (old.getContext("2d"));
  context.drawImage(canvas, -x0, -y0);
  return old;
}

const AT_WORK = "#ffb43c";
// Brackets are drawn inside their tiles, so that those of neighbours do not overlap; CSS pixels.
const WITHIN = 1.5;
const ARM = 16;

/**
 * Draw corner brackets around tiles that workers render.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {PictureScreen} screen
 * @param {PixelRectangle[]} tiles
 */
export function drawTiles(context, screen, tiles) {
  const { width, height } = screen;
  // Brackets around the whole picture have no meaning.
  const parts = tiles.filter(({ x0, y0, x1, y1 }) => x1 - x0 < width || y1 - y0 < height);
  if (!parts.length) return;
  context.beginPath();
  for (const tile of parts) bracket(context, screen, tile);
  strokeCased(context, AT_WORK);
}

/** @param {CanvasRenderingContext2D} context @param {PictureScreen} screen @param {PixelRectangle} tile */
function bracket(context, { left, top, scale }, { x0, y0, x1, y1 }) {
  const [l, t, r, b] = [
    left + scale * x0 + WITHIN,
    top + scale * y0 + WITHIN,
    left + scale * x1 - WITHIN,
    top + scale * y1 - WITHIN,
  ];
  const arm = Math.min(ARM, (r - l) / 3, (b - t) / 3);
  for (const [x, y, across, along] of [
    [l, t, arm, arm],
    [r, t, -arm, arm],
    [l, b, arm, -arm],
    [r, b, -arm, -arm],
  ]) {
    context.moveTo(x + across, y);
    context.lineTo(x, y);
    context.lineTo(x, y + along);
  }
}

// CSS pixels a side from which lines hide little.
const VISIBLE = 16;

/** Draw lines between pixels, once they are large. @param {CanvasRenderingContext2D} context @param {PictureScreen} screen */
export function drawGrid(context, screen) {
  const { scale, left, top } = screen;
  if (scale < VISIBLE) return;
  const { x0, y0, x1, y1 } = screen.visible();
  context.beginPath();
  for (let x = x0; x <= x1; x++) {
    context.moveTo(left + scale * x, top + scale * y0);
    context.lineTo(left + scale * x, top + scale * y1);
  }
  for (let y = y0; y <= y1; y++) {
    context.moveTo(left + scale * x0, top + scale * y);
    context.lineTo(left + scale * x1, top + scale * y);
  }
  context.strokeStyle = "rgb(128 128 128 / 40%)";
  context.lineWidth = 1;
  context.stroke();
}
