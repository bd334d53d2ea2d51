// Develops a film on a graphics card. All of its arithmetic is in whole numbers, so every card gives the same codes.

import { CHANNELS } from "./look.js";
import { ENTRIES, SHIFT } from "./transfer.js";
import { UNKNOWN } from "./film.js";

/** @typedef {import("./film.js").Film} Film @typedef {import("./film.js").Rectangle} Rectangle */

// A smaller picture is developed without a card in the time in which a context is made.
const WORTHWHILE = 512 * 512;
// Renderers without a card are ten times slower than our own loops.
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;
// The codes of a table stand in rows of a texture.
const COLUMNS = 512;

const FILM = 0;
const LUMINANCE = 1;
const TABLE = 2;

const VERTEX = `#version 300 es
void main() {
  gl_Position = vec4(float((gl_VertexID << 1) & 2) * 2.0 - 1.0, float(gl_VertexID & 2) * 2.0 - 1.0, 0.0, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
uniform usampler2D film;
uniform usampler2D luminance;
uniform usampler2D table;
uniform int height;
uniform int channel;
out vec4 color;

uint code(uint bits) {
  uint entry = bits >> ${SHIFT}u;
  uvec2 found = texelFetch(table, ivec2(entry % ${COLUMNS}u, entry / ${COLUMNS}u), 0).rg;
  return found.r + (bits >= found.g ? 1u : 0u);
}

void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  place.y = height - 1 - place.y;
  uvec3 bits = texelFetch(film, place, 0).rgb;
  if (bits.r == ${UNKNOWN}u) {
    color = vec4(0.0);
    return;
  }
  if (channel == ${CHANNELS.luminance}) bits = texelFetch(luminance, place, 0).rrr;
  else if (channel >= 0) bits = uvec3(bits[channel]);
  color = vec4(vec3(code(bits.r), code(bits.g), code(bits.b)) / 255.0, 1.0);
}`;

/** @type {boolean | null} */
let hasCard = null;

/** Whether there is a graphics card that is worth its while for so many pixels. @param {number} pixels */
export function hasGpuFor(pixels) {
  if (pixels <= WORTHWHILE) return false;
  hasCard ??= isCard(new OffscreenCanvas(1, 1).getContext("webgl2"));
  return hasCard;
}

/** @param {WebGL2RenderingContext | null} gl */
function isCard(gl) {
  if (!gl) return false;
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return !SOFTWARE.test(name);
}

/** A film in the memory of a graphics card. */
export class Gpu {
  /** @type {Map<string, WebGLUniformLocation | null>} */
  #places = new Map();
  /** @type {import("./transfer.js").Encoder | null} */
  #encoder = null;
  #weighed = false;

  /** @param {Film} film @param {WebGL2RenderingContext} gl */
  constructor(film, gl) {
    this.film = film;
    this.gl = gl;
    gl.useProgram(linked(gl));
    this.#texture(FILM, "film");
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGB32UI, film.width, film.height);
    this.#texture(LUMINANCE, "luminance");
    this.#texture(TABLE, "table");
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RG32UI, COLUMNS, ENTRIES / COLUMNS);
    gl.uniform1i(this.#place("height"), film.height);
    gl.viewport(0, 0, film.width, film.height);
    this.upload(film.whole);
  }

  /** The film on a card, or null if it cannot be there. @param {Film} film */
  static of(film) {
    const gl = new OffscreenCanvas(film.width, film.height).getContext("webgl2", {
      antialias: false,
      depth: false,
      premultipliedAlpha: false,
    });
    if (!gl || Math.max(film.width, film.height) > gl.getParameter(gl.MAX_TEXTURE_SIZE)) return null;
    const gpu = new Gpu(film, gl);
    return gl.getError() === gl.NO_ERROR ? gpu : null;
  }

  close() {
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }

  /** Copy a rectangle of the film to the card. @param {Rectangle} place */
  upload(place) {
    const { gl, film } = this;
    this.#copy(FILM, place, gl.RGB_INTEGER, film.bits);
    if (this.#weighed) this.#copy(LUMINANCE, place, gl.RED_INTEGER, new Uint32Array(film.luminance.buffer));
  }

  /**
   * Develop the whole film.
   *
   * @param {import("./look.js").Look} look
   * @returns {OffscreenCanvas | null} The picture, or null if the card was lost.
   */
  develop({ encoder, channel }) {
    const { gl } = this;
    if (channel === "luminance" && !this.#weighed) this.#weigh();
    if (encoder !== this.#encoder) this.#use(encoder);
    gl.uniform1i(this.#place("channel"), CHANNELS[channel]);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    return gl.isContextLost() ? null : /** @type {OffscreenCanvas} */ (gl.canvas);
  }

  #weigh() {
    const { gl, film } = this;
    this.#weighed = true;
    gl.activeTexture(gl.TEXTURE0 + LUMINANCE);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R32UI, film.width, film.height);
    this.#copy(LUMINANCE, film.whole, gl.RED_INTEGER, new Uint32Array(film.luminance.buffer));
  }

  /** @param {import("./transfer.js").Encoder} encoder */
  #use(encoder) {
    const { gl } = this;
    this.#encoder = encoder;
    gl.activeTexture(gl.TEXTURE0 + TABLE);
    for (const name of [gl.UNPACK_ROW_LENGTH, gl.UNPACK_SKIP_PIXELS, gl.UNPACK_SKIP_ROWS])
      gl.pixelStorei(name, 0);
    const size = [COLUMNS, ENTRIES / COLUMNS];
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, size[0], size[1], gl.RG_INTEGER, gl.UNSIGNED_INT, encoder.table);
  }

  /** @param {number} unit @param {Rectangle} place @param {number} format @param {Uint32Array} words */
  #copy(unit, { x0, y0, x1, y1 }, format, words) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, this.film.width);
    gl.pixelStorei(gl.UNPACK_SKIP_PIXELS, x0);
    gl.pixelStorei(gl.UNPACK_SKIP_ROWS, y0);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, x0, y0, x1 - x0, y1 - y0, format, gl.UNSIGNED_INT, words);
  }

  /** @param {number} unit @param {string} name */
  #texture(unit, name) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    gl.uniform1i(this.#place(name), unit);
  }

  /** @param {string} name */
  #place(name) {
    if (!this.#places.has(name)) {
      const program = this.gl.getParameter(this.gl.CURRENT_PROGRAM);
      this.#places.set(name, this.gl.getUniformLocation(program, name));
    }
    return this.#places.get(name) ?? null;
  }
}

/** @param {WebGL2RenderingContext} gl */
function linked(gl) {
  const program = gl.createProgram();
  for (const [type, source] of /** @type {[number, string][]} */ ([
    [gl.VERTEX_SHADER, VERTEX],
    [gl.FRAGMENT_SHADER, FRAGMENT],
  ])) {
    const shader = gl.createShader(type);
    if (!shader) break; // The context is lost.
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  return program;
}
