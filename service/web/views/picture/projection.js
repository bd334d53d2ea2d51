// From points of the scene to places on its picture.

/** a + factor b. @param {number[]} a @param {number[]} b */
export const add = (a, b, factor = 1) => a.map((value, i) => value + factor * b[i]);
/** @param {number[]} a @param {number[]} b */
const subtract = (a, b) => add(a, b, -1);
/** @param {number[]} a @param {number[]} b */
const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
/** @param {number[]} a @param {number[]} b */
export const cross = (a, b) =>
  [0, 1, 2].map((i) => a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
/** @param {number[]} a */
export const unit = (a) => a.map((value) => value / Math.hypot(...a));

// What is nearer to the camera than this share of the far end of a line is cut off.
const NEAR = 1e-4;

/** The camera of a scene, with the defaults of the scene language. */
export class Projection {
  /** @param {CameraDocument} camera */
  constructor({
    position,
    look_at: aim,
    up = [0, 1, 0],
    vertical_fov: fov = 40,
    width = 512,
    height = 512,
    crop,
  }) {
    this.position = position;
    this.forward = unit(subtract(aim, position));
    const right = cross(this.forward, unit(up));
    this.right = unit(Math.hypot(...right) > 0 ? right : cross(this.forward, leastAxis(this.forward)));
    this.up = cross(this.right, this.forward);
    this.half = Math.tan((fov * Math.PI) / 360);
    this.width = width;
    this.height = height;
    const [left, top] = crop ?? [0, 0];
    this.left = left;
    this.top = top;
  }

  /** @param {number[]} point */
  depth(point) {
    return dot(subtract(point, this.position), this.forward);
  }

  /**
   * The place of a point in pixels of the picture, or null if it is not before the camera.
   *
   * @param {number[]} point
   * @returns {PixelPlace | null}
   */
  place(point) {
    const depth = this.depth(point);
    if (!(depth > 0)) return null;
    const from = subtract(point, this.position);
    const [x, y] = [dot(from, this.right), dot(from, this.up)].map((value) => value / (depth * this.half));
    // Pixels are square, so that both are in units of half the height.
    return {
      x: this.width / 2 + (x * this.height) / 2 - this.left,
      y: this.height / 2 - (y * this.height) / 2 - this.top,
    };
  }

  /**
   * The part of a line that is before the camera, as two places, or null.
   *
   * @param {number[]} a
   * @param {number[]} b
   * @returns {[PixelPlace, PixelPlace] | null}
   */
  line(a, b) {
    const [near, far] = [this.depth(a), this.depth(b)];
    const least = NEAR * Math.max(near, far);
    if (!(least > 0)) return null;
    /** @param {number[]} from @param {number[]} to @param {number} depth @param {number} other */
    const at = (from, to, depth, other) =>
      this.place(depth >= least ? from : add(from, subtract(to, from), (least - depth) / (other - depth)));
    const [first, last] = [at(a, b, near, far), at(b, a, far, near)];
    return first && last && [first, last];
  }
}

/** @param {number[]} direction */
function leastAxis(direction) {
  const sizes = direction.map(Math.abs);
  return [0, 1, 2].map((i) => Number(i === sizes.indexOf(Math.min(...sizes))));
}
