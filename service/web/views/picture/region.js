// Choosing a rectangle of the picture: by dragging with Shift.

/**
 * Call back with the rectangle that is dragged over with Shift held, while it grows and when it is done.
 *
 * @param {PictureScreen} screen
 * @param {(region: import("./film.js").Rectangle) => void} chosen
 */
export function hearRegion(screen, chosen) {
  const { element, signal } = screen;
  /** @type {{x: number, y: number} | null} */
  let begun = null;
  // Before the listeners that pan.
  const options = { signal, capture: true };

  const pixel = (/** @type {PointerEvent} */ event) => {
    const { x, y } = screen.placeOf(event);
    const whole = (/** @type {number} */ place, /** @type {number} */ count) =>
      Math.min(count - 1, Math.max(0, Math.floor(place / screen.scale)));
    return {
      x: whole(x - screen.left, screen.width),
      y: whole(y - screen.top, screen.height),
    };
  };

  const take = (/** @type {PointerEvent} */ event) => {
    if (!begun) return;
    event.stopImmediatePropagation();
    const end = pixel(event);
    chosen({
      x0: Math.min(begun.x, end.x),
      y0: Math.min(begun.y, end.y),
      x1: Math.max(begun.x, end.x) + 1,
      y1: Math.max(begun.y, end.y) + 1,
    });
    screen.redraw();
  };

  element.addEventListener(
    "pointerdown",
    (/** @type {PointerEvent} */ event) => {
      if (event.button !== 0 || !event.shiftKey) return;
      element.setPointerCapture(event.pointerId);
      begun = pixel(event);
      take(event);
    },
    options,
  );
  element.addEventListener("pointermove", take, options);
  for (const end of /** @type {const} */ (["pointerup", "pointercancel"]))
    element.addEventListener(end, (event) => (take(event), (begun = null)), options);
}
