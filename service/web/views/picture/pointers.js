// Mouse and touch over a screen: drag pans, wheel and two fingers zoom, a click chooses a pixel.

// A hand shakes: below so many CSS pixels a press is a click and no drag.
const SHAKE = 5;
// A notch of most wheels is 100 to 120 units: it zooms by about a quarter.
const WHEEL = 0.002;
// Wheels that count in lines tell some 3 a notch.
const LINE = 36;

export function hearPointers(screen) {
  const { element, life } = screen;
  const down = new Map();
  let dragged = false;
  const place = (event) => {
    const box = element.getBoundingClientRect();
    return { x: event.clientX - box.left - element.clientLeft, y: event.clientY - box.top - element.clientTop };
  };
  const on = (type, listener, options = {}) => element.addEventListener(type, listener, { signal: life.signal, ...options });

  on("pointerdown", (event) => {
    if (event.button !== 0) return;
    element.setPointerCapture(event.pointerId);
    // Two fingers never choose a pixel, however still they are.
    dragged = down.size > 0;
    down.set(event.pointerId, { now: place(event), begun: place(event) });
  });

  on("pointermove", (event) => {
    const finger = down.get(event.pointerId);
    const now = place(event);
    if (!finger) return screen.point(screen.pixelAt(now.x, now.y));
    const before = grip(down);
    dragged ||= Math.hypot(now.x - finger.begun.x, now.y - finger.begun.y) > SHAKE;
    finger.now = now;
    if (dragged) follow(screen, before, grip(down));
  });

  const lifted = (event) => {
    const finger = down.get(event.pointerId);
    down.delete(event.pointerId);
    if (!finger || dragged || down.size || event.type === "pointercancel") return;
    const pixel = screen.pixelAt(finger.now.x, finger.now.y);
    if (pixel) screen.choose(pixel);
  };
  on("pointerup", lifted);
  on("pointercancel", lifted);
  on("pointerleave", () => !down.size && document.activeElement !== element && screen.point(null));

  on(
    "wheel",
    (event) => {
      // The whole picture cannot be made smaller: then the wheel is the page's.
      if (screen.fitted && event.deltaY > 0) return;
      event.preventDefault();
      const { x, y } = place(event);
      screen.zoom(screen.scale * Math.exp(-WHEEL * event.deltaY * (event.deltaMode ? LINE : 1)), x, y);
    },
    { passive: false },
  );
}

/** The middle of the fingers, and how far they are apart. */
function grip(down) {
  const fingers = [...down.values()].map((finger) => finger.now);
  const x = fingers.reduce((sum, finger) => sum + finger.x, 0) / fingers.length;
  const y = fingers.reduce((sum, finger) => sum + finger.y, 0) / fingers.length;
  const span = fingers.length > 1 ? Math.hypot(fingers[0].x - fingers[1].x, fingers[0].y - fingers[1].y) : 0;
  return { x, y, span };
}

function follow(screen, before, after) {
  if (before.span && after.span) screen.zoom((screen.scale * after.span) / before.span, before.x, before.y);
  if (!screen.fitted) screen.show({ scale: screen.scale, left: screen.left + after.x - before.x, top: screen.top + after.y - before.y });
}
