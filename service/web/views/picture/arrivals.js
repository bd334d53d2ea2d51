// Tiles that arrive fade in over what was there before.

const LASTS_MS = 350;
// Snapshots cost memory and time: with more tiles at once, the picture changes at once.
const MOST = 24;

/** @param {import("./screen.js").Screen} screen */
export function makeArrivals(screen) {
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  let fading = [];

  return {
    /** Keep what the picture shows where tiles will be drawn. */
    before(tiles) {
      if (still.matches || document.hidden || tiles.length > MOST) return;
      const begun = performance.now();
      for (const { x0, y0, x1, y1 } of tiles)
        fading.push({ x0, y0, begun, old: piece(screen.canvas, x0, y0, x1, y1) });
      fading = fading.slice(-2 * MOST);
    },
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

function piece(canvas, x0, y0, x1, y1) {
  const [width, height] = [Math.min(x1, canvas.width) - x0, Math.min(y1, canvas.height) - y0];
  const old = new OffscreenCanvas(Math.max(1, width), Math.max(1, height));
  old.getContext("2d").drawImage(canvas, -x0, -y0);
  return old;
}
