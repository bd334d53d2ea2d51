// Draws films or a layer on a screen, and the numbers in its pixels. Of two films, the second begins at a column.

import { unpack } from "./colormaps.js";
import { Darkroom, develop } from "./darkroom.js";
import { area } from "./film.js";
import { plainLook } from "./look.js";
import { drawNumbers, minus, short } from "./numbers.js";
import { Encoder } from "./transfer.js";

/** @typedef {import("./film.js").Film} Film @typedef {import("./film.js").Rectangle} Rectangle */
/** @typedef {import("./layers.js").Layer} Layer */

/**
 * Measure the duration of a function on the browser's timeline; only the newest measure of a name is kept.
 *
 * @template T
 * @param {string} name
 * @param {object} detail
 * @param {() => T} work
 * @returns {T}
 */
export function measured(name, detail, work) {
  const start = performance.now();
  const result = work();
  performance.clearMeasures(name);
  performance.measure(name, { start, end: performance.now(), detail });
  return result;
}

export class Developer {
  /** @type {Darkroom[]} */
  #darkrooms = [];

  /** @param {PictureScreen} screen @param {Film} film */
  constructor(screen, film) {
    this.screen = screen;
    this.look = plainLook();
    /** @type {Layer | null} */
    this.layer = null;
    /** Where the second film begins. */
    this.column = screen.width;
    this.#darkrooms = [new Darkroom(film)];
  }

  close() {
    for (const darkroom of this.#darkrooms) darkroom.close();
  }

  get films() {
    return this.#darkrooms.map(({ film }) => film);
  }

  /** Compare with a second film, in place of one before. @param {Film} film */
  compare(film) {
    this.#darkrooms[1]?.close();
    this.#darkrooms[1] = new Darkroom(film);
    this.change({});
  }

  /** Show the second film from a column on. @param {number} column */
  split(column) {
    const ends = [this.column, column].sort((one, other) => one - other);
    this.column = column;
    if (!this.layer) this.#put({ ...this.films[0].whole, x0: ends[0], x1: ends[1] });
    this.screen.redraw();
  }

  /** The film that is shown in a column. @param {number} x */
  filmAt(x) {
    return this.#darkrooms[x < this.column ? 0 : 1].film;
  }

  /** Take a batch of tiles. @param {import("./film.js").Tile[]} tiles */
  take(tiles) {
    measured("penumbra:paint", { tiles: tiles.length }, () => {
      const [darkroom] = this.#darkrooms;
      const places = tiles.map((tile) => darkroom.film.take(tile));
      for (const place of places) darkroom.changed(place);
      if (!this.layer) this.#putAll(places);
      this.screen.redraw();
    });
  }

  /** @param {number} exposure @param {string} transfer */
  expose(exposure, transfer) {
    measured("penumbra:expose", { pixels: area(this.films[0].whole) }, () =>
      this.change({ encoder: new Encoder(exposure, transfer) }),
    );
  }

  /** Change a part of the look. @param {Partial<import("./look.js").Look>} part */
  change(part) {
    this.look = { ...this.look, ...part };
    if (!this.layer) this.#put(this.films[0].whole);
    // The numbers in pixels are codes.
    this.screen.redraw();
  }

  /** Show a layer, or the picture where it is null. @param {Layer | null} layer */
  show(layer) {
    this.layer = layer;
    measured("penumbra:layer", { name: layer?.name }, () => {
      if (layer) this.screen.context.putImageData(layer.develop(this.#darkrooms[0].blank()), 0, 0);
      else this.#put(this.films[0].whole);
    });
    this.screen.redraw();
  }

  /** The values on the screen. @returns {{values: ArrayLike<number>, channels: number}} */
  get shown() {
    return this.layer ?? { values: this.filmAt(0).values, channels: 3 };
  }

  /** The codes of a pixel, or null while it is not known. @param {number} x @param {number} y */
  codes(x, y) {
    return (
      this.filmAt(x)
        .at(x, y)
        ?.map((value) => this.look.encoder.code(value)) ?? null
    );
  }

  /** The values of a pixel as text. @param {number} x @param {number} y */
  describe(x, y) {
    if (this.films.length > 1) return this.#describeBoth(x, y);
    if (this.layer) return `${this.layer.name} ${triple(this.layer.at(x, y))}`;
    const values = this.films[0].at(x, y);
    return values ? `linear ${triple(values)}   shown ${this.codes(x, y)?.join("  ")}` : "not rendered yet";
  }

  /** @param {number} x @param {number} y */
  #describeBoth(x, y) {
    const [a, b] = this.films.map((film) => film.at(x, y) ?? []);
    const apart = a.map((value, i) => minus(value, b[i]));
    return `\nA ${triple(a)}\nB ${triple(b)}\nA − B ${triple(apart)}`;
  }

  /**
   * The colour of a pixel on the screen, computed: a canvas on a graphics card is slow to read.
   *
   * @param {number} x
   * @param {number} y
   * @returns {number[]} RGBA codes, transparent where the picture is not known.
   */
  color(x, y) {
    if (this.layer) return [...this.layer.codes(x, y), 255];
    const packed = new Uint32Array(1);
    develop(this.filmAt(x), this.look, { x0: x, y0: y, x1: x + 1, y1: y + 1 }, packed);
    return [...unpack(packed[0]), packed[0] >>> 24];
  }

  /** @param {CanvasRenderingContext2D} context */
  drawNumbers(context) {
    const { screen, layer } = this;
    if (layer)
      return drawNumbers(
        context,
        screen,
        (x, y) => layer.at(x, y).map(short),
        (x, y) => layer.codes(x, y),
      );
    drawNumbers(
      context,
      screen,
      (x, y) => this.#lines(x, y),
      (x, y) => this.codes(x, y) ?? [],
    );
  }

  /** @param {number} x @param {number} y */
  #lines(x, y) {
    const codes = this.codes(x, y);
    const values = this.filmAt(x).at(x, y);
    return codes && values && values.map((value, i) => `${short(value)} ${String(codes[i]).padStart(4)}`);
  }

  /** Develop neighbouring tiles in one call: a call costs more than some more pixels. @param {Rectangle[]} places */
  #putAll(places) {
    const box = around(places);
    const covered = places.reduce((sum, place) => sum + area(place), 0);
    if (places.length > 1 && area(box) <= 2 * covered) this.#put(box);
    else for (const place of places) this.#put(place);
  }

  /** @param {Rectangle} place */
  #put(place) {
    const { context } = this.screen;
    const column = Math.min(place.x1, Math.max(place.x0, this.column));
    this.#darkrooms[0].paint(context, this.look, { ...place, x1: column });
    this.#darkrooms[1]?.paint(context, this.look, { ...place, x0: column });
  }
}

/** @param {number[]} values */
const triple = (values) => values.map(short).join("  ");

/** @param {Rectangle[]} places @returns {Rectangle} */
function around(places) {
  const box = { x0: Infinity, y0: Infinity, x1: 0, y1: 0 };
  for (const { x0, y0, x1, y1 } of places) {
    box.x0 = Math.min(box.x0, x0);
    box.y0 = Math.min(box.y0, y0);
    box.x1 = Math.max(box.x1, x1);
    box.y1 = Math.max(box.y1, y1);
  }
  return box;
}
