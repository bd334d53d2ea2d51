// Keyboard control of a screen: arrows move a cursor from pixel to pixel, other keys zoom and choose.

/** @type {Record<string, [number, number]>} */
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const FAR = 10;
const STEP = Math.SQRT2;

export const KEYS =
  "Arrow keys move from pixel to pixel, with Shift by ten. Plus and minus zoom, 0 fits, 1 shows one to one. C copies the values. " +
  "Enter explains the pixel. Escape removes regions and lines.";

/** @param {PictureScreen} screen */
export function hearKeys(screen) {
  const middle = () => ({ x: Math.floor(screen.width / 2), y: Math.floor(screen.height / 2) });
  /** @returns {[number, number]} */
  const around = () => {
    const { x, y } = screen.cursor ?? middle();
    return [screen.left + screen.scale * (x + 0.5), screen.top + screen.scale * (y + 0.5)];
  };
  /** @type {Record<string, () => void>} */
  const actions = {
    "+": () => screen.zoom(screen.scale * STEP, ...around()),
    "=": () => screen.zoom(screen.scale * STEP, ...around()),
    "-": () => screen.zoom(screen.scale / STEP, ...around()),
    0: () => screen.fit(),
    1: () => screen.zoom(1 / devicePixelRatio, ...around()),
    c: () => screen.emit("copy", screen.cursor ?? middle()),
    Escape: () => screen.emit("clear", null),
    Enter: () => screen.choose(screen.cursor ?? middle()),
  };

  /** @param {[number, number]} direction @param {number} far */
  function move([across, along], far) {
    const { x, y } = screen.cursor ?? middle();
    const pixel = {
      x: Math.min(screen.width - 1, Math.max(0, x + across * far)),
      y: Math.min(screen.height - 1, Math.max(0, y + along * far)),
    };
    screen.reveal(pixel);
    screen.point(pixel);
  }

  const listener = (/** @type {KeyboardEvent} */ event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (MOVES[event.key]) move(MOVES[event.key], event.shiftKey ? FAR : 1);
    else if (actions[event.key]) actions[event.key]();
    else return;
    event.preventDefault();
  };
  screen.element.addEventListener("keydown", listener, { signal: screen.signal });
}
