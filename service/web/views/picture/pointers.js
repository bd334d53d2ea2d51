// Mouse and touch control of a screen: drag pans, wheel and two fingers zoom, a click chooses a pixel.

// A press that moves by fewer CSS pixels is a click, not a drag.
const SHAKE = 5;
// A notch of most wheels is 100 to 120 units: it zooms by about a quarter.
const WHEEL = 0.002;
// Wheels that report lines report about 3 for a notch.
const LINE = 36;

/** @typedef {Map<number, {now: PixelPlace, begun: PixelPlace}>} Fingers Places in CSS pixels of the element. */

/** @param {PictureScreen} screen */
export function hearPointers(screen) {
  const { element, signal } = screen;
  /** @type {Fingers} */
  const down = new Map();
  let dragged = false;
  let gripped = false;
  /** @param {"down" | "move" | "up" | "cancel" | "leave"} type @param {(event: PointerEvent) => void} listener */
  const on = (type, listener) => element.addEventListener(`pointer${type}`, listener, { signal });

  on("down", (event) => {
    if (event.button !== 0) return;
    element.setPointerCapture(event.pointerId);
    gripped = !down.size && Boolean(screen.grip?.holds(screen.placeOf(event)));
    // A press with two fingers never chooses a pixel.
    dragged = down.size > 0;
    down.set(event.pointerId, { now: screen.placeOf(event), begun: screen.placeOf(event) });
  });

  on("move", (event) => {
    const finger = down.get(event.pointerId);
    const now = screen.placeOf(event);
    if (!finger) {
      element.classList.toggle("gripping", Boolean(screen.grip?.holds(now)));
      return screen.point(screen.pixelAt(now.x, now.y));
    }
    const before = grip(down);
    dragged ||= Math.hypot(now.x - finger.begun.x, now.y - finger.begun.y) > SHAKE;
    finger.now = now;
    if (gripped) screen.grip?.drag(now);
    else if (dragged) follow(screen, before, grip(down));
  });

  const lifted = (/** @type {PointerEvent} */ event) => {
    const finger = down.get(event.pointerId);
    down.delete(event.pointerId);
    if (!finger || dragged || gripped || down.size || event.type === "pointercancel") return;
    const pixel = screen.pixelAt(finger.now.x, finger.now.y);
    if (pixel) screen.choose(pixel);
  };
  on("up", lifted);
  on("cancel", lifted);
  on("leave", () => !down.size && document.activeElement !== element && screen.point(null));

  element.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const { x, y } = screen.placeOf(event);
      screen.zoom(screen.scale * Math.exp(-WHEEL * event.deltaY * (event.deltaMode ? LINE : 1)), x, y);
    },
    { passive: false, signal },
  );
}

/** The centre of the fingers, and their distance. @param {Fingers} down */
function grip(down) {
  const fingers = [...down.values()].map((finger) => finger.now);
  const x = fingers.reduce((sum, finger) => sum + finger.x, 0) / fingers.length;
  const y = fingers.reduce((sum, finger) => sum + finger.y, 0) / fingers.length;
  const span = fingers.length > 1 ? Math.hypot(fingers[0].x - fingers[1].x, fingers[0].y - fingers[1].y) : 0;
  return { x, y, span };
}

/** @param {PictureScreen} screen @param {ReturnType<typeof grip>} before @param {ReturnType<typeof grip>} after */
function follow(screen, before, after) {
  if (before.span && after.span) screen.zoom((screen.scale * after.span) / before.span, before.x, before.y);
  if (!screen.fitted)
    screen.show({
      scale: screen.scale,
      left: screen.left + after.x - before.x,
      top: screen.top + after.y - before.y,
    });
}
