// Lines between pixels, once they are large.

// CSS pixels a side from which lines hide little.
const VISIBLE = 16;

/** @param {CanvasRenderingContext2D} context @param {PictureScreen} screen */
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
