// Corner brackets around the tiles that workers render.

const AT_WORK = "#ffb43c";
// Brackets are drawn inside their tiles, so that those of neighbours do not overlap; CSS pixels.
const WITHIN = 1.5;
const ARM = 16;

/** @param {CanvasRenderingContext2D} context @param {import("./screen.js").Screen} screen @param {object[]} tiles */
export function drawTiles(context, screen, tiles) {
  const { width, height } = screen;
  // Brackets around the whole picture have no meaning.
  const parts = tiles.filter(({ x0, y0, x1, y1 }) => x1 - x0 < width || y1 - y0 < height);
  if (!parts.length) return;
  context.beginPath();
  for (const tile of parts) bracket(context, screen, tile);
  for (const [style, line] of [
    ["#000", 3.5],
    [AT_WORK, 1.75],
  ]) {
    context.strokeStyle = style;
    context.lineWidth = line;
    context.stroke();
  }
}

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
