// A picture with zoom, pan and a cursor, for mouse, touch and keyboard. The caller draws the overlay.

import { Emitter, h } from "../../dom.js";
import { hasGpuFor } from "./gpu.js";
import { hearKeys } from "./keys.js";
import { hearPointers } from "./pointers.js";

const LARGEST = 128;
// In smaller pixels the cursor would hide the pixel.
const CURSOR_FROM = 3;
// CSS pixels between a rectangle and the middle of its frame.
const AROUND = 0.5;

/**
 * @typedef {object} ScreenEvents
 * @property {PixelPlace | null} cursor - The pixel under the cursor.
 * @property {PixelPlace} choose - The pixel clicked.
 * @property {PixelPlace} copy - The pixel whose values are wanted.
 * @property {null} clear - Regions and lines are to be removed.
 * @property {null} view - The visible part changed.
 */

/** @extends {Emitter<ScreenEvents>} */
export class Screen extends Emitter {
  #resize;
  #frame = 0;
  // Of the element, when the place of the picture was last set.
  #size = [0, 0];
  /** @type {PixelPlace | null} */
  cursor = null;
  /**
   * What is dragged in place of the picture. Places are in CSS pixels of the element.
   *
   * @type {{holds: (place: PixelPlace) => boolean, drag: (place: PixelPlace) => void} | null}
   */
  grip = null;

  /**
   * @param {{width: number, height: number, label: string, overlay?: (context: CanvasRenderingContext2D, screen: Screen)
   *   => void}} options - `overlay` draws over the picture, in pixels of CSS.
   */
  constructor({ width, height, label, overlay = () => {} }) {
    super();
    this.width = width;
    this.height = height;
    this.overlay = overlay;
    this.canvas = h("canvas.pixels", { width, height });
    // In main memory, unless a graphics card writes its pixels.
    this.context = /** @type {CanvasRenderingContext2D} */ (
      this.canvas.getContext("2d", { willReadFrequently: !hasGpuFor(width * height) })
    );
    this.over = h("canvas.over");
    this.element = h(
      "div.screen",
      { tabIndex: 0, role: "application", "aria-label": label },
      this.canvas,
      this.over,
    );
    this.scale = 1;
    this.left = 0;
    this.top = 0;
    this.fitted = true;
    hearPointers(this);
    hearKeys(this);
    for (const type of ["focus", "blur"])
      this.element.addEventListener(type, () => this.redraw(), { signal: this.signal });
    this.#resize = new ResizeObserver(() => this.#resized());
    this.#resize.observe(this.element);
  }

  close() {
    this.life.abort();
    this.#resize.disconnect();
    cancelAnimationFrame(this.#frame);
  }

  /** The scale that shows the whole picture as large as possible. */
  get fitting() {
    const { clientWidth, clientHeight } = this.element;
    return Math.min(clientWidth / this.width, clientHeight / this.height) || 1;
  }

  /** Pixels of the display for one of the picture. */
  get zoomed() {
    return this.scale * devicePixelRatio;
  }

  /** @param {number} scale */
  #within(scale) {
    const { fitting } = this;
    // Small pictures begin large, and large ones small: both can be seen one to one, and enlarged from where they begin.
    return Math.min(Math.max(LARGEST, 2 * fitting), Math.max(Math.min(fitting, 1 / devicePixelRatio), scale));
  }

  fit() {
    this.scale = this.fitting;
    this.left = (this.element.clientWidth - this.scale * this.width) / 2;
    this.top = (this.element.clientHeight - this.scale * this.height) / 2;
    this.fitted = true;
    this.#moved();
  }

  /** Set the scale, keeping a point of the element (in CSS pixels) fixed. @param {number} scale */
  zoom(scale, x = this.element.clientWidth / 2, y = this.element.clientHeight / 2) {
    const wanted = this.#within(scale);
    if (wanted === this.fitting) return this.fit();
    const ratio = wanted / this.scale;
    this.show({ scale: wanted, left: x - ratio * (x - this.left), top: y - ratio * (y - this.top) });
  }

  /** @param {{scale: number, left: number, top: number}} view */
  show({ scale, left, top }) {
    const { clientWidth, clientHeight } = this.element;
    this.scale = scale;
    this.left = held(left, scale * this.width, clientWidth);
    this.top = held(top, scale * this.height, clientHeight);
    this.fitted = false;
    this.#moved();
  }

  /** The place of the picture in the middle of the element, in its pixels. */
  get middle() {
    const { clientWidth, clientHeight } = this.element;
    return { x: (clientWidth / 2 - this.left) / this.scale, y: (clientHeight / 2 - this.top) / this.scale };
  }

  /** Show a place of the picture in the middle. @param {PixelPlace & {scale: number}} place */
  look({ x, y, scale }) {
    const { clientWidth, clientHeight } = this.element;
    this.show({
      scale: this.#within(scale),
      left: clientWidth / 2 - scale * x,
      top: clientHeight / 2 - scale * y,
    });
  }

  /** Zoom to a rectangle of the picture with some of its surroundings. @param {PixelRectangle} place */
  frame({ x0, y0, x1, y1 }) {
    const { clientWidth, clientHeight } = this.element;
    const loose = 0.6 * Math.min(clientWidth / (x1 - x0), clientHeight / (y1 - y0));
    const scale = Math.min(Math.max(LARGEST / 2, this.fitting), Math.max(this.fitting, loose));
    this.show({
      scale,
      left: clientWidth / 2 - (scale * (x0 + x1)) / 2,
      top: clientHeight / 2 - (scale * (y0 + y1)) / 2,
    });
  }

  /** The visible rectangle, including pixels that are visible in part. */
  visible() {
    const { clientWidth, clientHeight } = this.element;
    const ends = (/** @type {number} */ start, /** @type {number} */ room, /** @type {number} */ count) => [
      Math.max(0, Math.floor(-start / this.scale)),
      Math.min(count, Math.ceil((room - start) / this.scale)),
    ];
    const [x0, x1] = ends(this.left, clientWidth, this.width);
    const [y0, y1] = ends(this.top, clientHeight, this.height);
    return { x0, y0, x1, y1 };
  }

  /** Where the pointer is, in CSS pixels of the element. @param {MouseEvent} event @returns {PixelPlace} */
  placeOf(event) {
    const { left, top } = this.element.getBoundingClientRect();
    return {
      x: event.clientX - left - this.element.clientLeft,
      y: event.clientY - top - this.element.clientTop,
    };
  }

  /** The pixel at a point of the element, or null outside the picture. @param {number} x @param {number} y */
  pixelAt(x, y) {
    const pixel = { x: Math.floor((x - this.left) / this.scale), y: Math.floor((y - this.top) / this.scale) };
    return pixel.x >= 0 && pixel.y >= 0 && pixel.x < this.width && pixel.y < this.height ? pixel : null;
  }

  /** Move the cursor. @param {PixelPlace | null} pixel */
  point(pixel) {
    if (pixel?.x === this.cursor?.x && pixel?.y === this.cursor?.y) return;
    this.cursor = pixel;
    this.redraw();
    this.emit("cursor", pixel);
  }

  /** @param {PixelPlace} pixel */
  choose(pixel) {
    this.point(pixel);
    this.emit("choose", pixel);
  }

  /** Pan so that a pixel is visible. @param {PixelPlace} pixel */
  reveal({ x, y }) {
    const { clientWidth, clientHeight } = this.element;
    const left = Math.min(Math.max(this.left, -this.scale * x), clientWidth - this.scale * (x + 1));
    const top = Math.min(Math.max(this.top, -this.scale * y), clientHeight - this.scale * (y + 1));
    if (!this.fitted && (left !== this.left || top !== this.top)) this.show({ scale: this.scale, left, top });
  }

  /** Draw the overlay again, once before the next frame. */
  redraw() {
    if (!this.#frame && !this.signal.aborted) this.#frame = requestAnimationFrame(() => this.#draw());
  }

  /** Keep what is in the middle there. */
  #resized() {
    const { clientWidth, clientHeight } = this.element;
    const [width, height] = this.#size;
    if (this.fitted) return this.fit();
    this.show({
      scale: this.scale,
      left: this.left + (clientWidth - width) / 2,
      top: this.top + (clientHeight - height) / 2,
    });
  }

  #moved() {
    this.#size = [this.element.clientWidth, this.element.clientHeight];
    const density = this.scale * devicePixelRatio;
    this.canvas.style.transform = `translate(${this.left}px, ${this.top}px) scale(${this.scale})`;
    this.canvas.classList.toggle("crisp", density >= 2);
    this.redraw();
    this.emit("view", null);
  }

  #draw() {
    this.#frame = 0;
    const { clientWidth, clientHeight } = this.element;
    const [width, height] = [clientWidth, clientHeight].map((side) => Math.round(side * devicePixelRatio));
    if (this.over.width !== width || this.over.height !== height) Object.assign(this.over, { width, height });
    const context = /** @type {CanvasRenderingContext2D} */ (this.over.getContext("2d"));
    context.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    context.clearRect(0, 0, clientWidth, clientHeight);
    this.overlay(context, this);
    if (this.cursor && (this.scale >= CURSOR_FROM || document.activeElement === this.element))
      this.outline(context, square(this.cursor));
  }

  /** Draw a frame around a rectangle. @param {CanvasRenderingContext2D} context @param {PixelRectangle} place */
  outline(context, { x0, y0, x1, y1 }, color = "#fff") {
    const { left, top, scale } = this;
    context.beginPath();
    context.rect(
      left + scale * x0 - AROUND,
      top + scale * y0 - AROUND,
      scale * (x1 - x0) + 2 * AROUND,
      scale * (y1 - y0) + 2 * AROUND,
    );
    strokeCased(context, color);
  }
}

/** Stroke a path, visible on light and dark pixels. @param {CanvasRenderingContext2D} context @param {string} color */
export function strokeCased(context, color, dashes = /** @type {number[]} */ ([])) {
  context.setLineDash(dashes);
  for (const [strokeStyle, lineWidth] of /** @type {const} */ ([
    ["#000", 3.5],
    [color, 1.5],
  ])) {
    Object.assign(context, { strokeStyle, lineWidth });
    context.stroke();
  }
  context.setLineDash([]);
}

/** One pixel as a rectangle. @param {PixelPlace} pixel @returns {PixelRectangle} */
export const square = ({ x, y }) => ({ x0: x, y0: y, x1: x + 1, y1: y + 1 });

/**
 * Limit where the picture begins: centred if it is smaller than the element, else without empty margins.
 *
 * @param {number} start
 * @param {number} size
 * @param {number} room
 */
function held(start, size, room) {
  return size <= room ? (room - size) / 2 : Math.min(0, Math.max(room - size, start));
}
