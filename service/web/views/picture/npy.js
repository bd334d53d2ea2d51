// Reads NPY files: arrays of real numbers as NumPy writes them, of any of its usual types.

const MAGIC = 0x934e554d;
const HEADER = /'descr': '([<>|=])([fiu][1248])', 'fortran_order': (True|False), 'shape': \(([^)]*)\)/;
const LITTLE = new Uint8Array(new Uint16Array([1]).buffer)[0] === 1;

/** @typedef {Float32Array | Float64Array | Int32Array | Uint8Array | Uint16Array} Values */
/** @typedef {{shape: number[], values: Values, type: string}} NpyArray `type` is that of the file, such as "f4". */

/**
 * The types that are read.
 *
 * @type {Record<string, {Kind: new (length: number) => Values,
 *   read: (view: DataView, at: number, little: boolean) => number}>}
 */
const TYPES = {
  f2: { Kind: Float32Array, read: (view, at, little) => half(view.getUint16(at, little)) },
  f4: { Kind: Float32Array, read: (view, at, little) => view.getFloat32(at, little) },
  f8: { Kind: Float64Array, read: (view, at, little) => view.getFloat64(at, little) },
  i4: { Kind: Int32Array, read: (view, at, little) => view.getInt32(at, little) },
  u1: { Kind: Uint8Array, read: (view, at) => view.getUint8(at) },
  u2: { Kind: Uint16Array, read: (view, at, little) => view.getUint16(at, little) },
};

/** The value of a half-precision float (IEEE 754 binary16). @param {number} bits @returns {number} */
export function half(bits) {
  const sign = bits & 0x8000 ? -1 : 1;
  const exponent = (bits >> 10) & 31;
  const fraction = bits & 0x3ff;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return sign * (exponent ? (1 + fraction / 1024) * 2 ** (exponent - 15) : fraction * 2 ** -24);
}

/**
 * @param {ArrayBuffer} buffer
 * @returns {NpyArray} Values in C order.
 * @throws {Error} If it is no NPY file, is cut off, or has another type of numbers.
 */
export function decodeNpy(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < 12 || view.getUint32(0) !== MAGIC) throw new Error("This is not an .npy file.");
  const long = view.getUint8(6) > 1;
  const start = long ? 12 + view.getUint32(8, true) : 10 + view.getUint16(8, true);
  const head = new TextDecoder("latin1").decode(buffer.slice(long ? 12 : 10, start));
  const [, order, type, fortran, sides] = HEADER.exec(head) ?? [];
  if (!TYPES[type]) throw new Error("This .npy file has an unsupported type of numbers.");
  const shape = sides.split(",").flatMap((side) => (side.trim() ? [Number(side)] : []));
  const size = shape.reduce((product, side) => product * side, 1);
  if (start + size * Number(type[1]) > buffer.byteLength) throw new Error("This .npy file is cut off.");
  const values = read(view, start, type, order !== ">", size);
  return { shape, values: fortran === "True" ? inRows(values, shape) : values, type };
}

/**
 * @param {DataView} view
 * @param {number} start
 * @param {string} type
 * @param {boolean} little
 * @param {number} size
 */
function read(view, start, type, little, size) {
  const { Kind, read: one } = TYPES[type];
  const values = new Kind(size);
  const bytes = Number(type[1]);
  if (bytes === values.BYTES_PER_ELEMENT && (little === LITTLE || bytes === 1))
    new Uint8Array(values.buffer).set(new Uint8Array(view.buffer, start, size * bytes));
  else for (let i = 0; i < size; i++) values[i] = one(view, start + i * bytes, little);
  return values;
}

/**
 * Values in C order from values whose first index changes fastest.
 *
 * @param {Values} values
 * @param {number[]} shape
 */
function inRows(values, shape) {
  const steps = shape.map((_, axis) => shape.slice(0, axis).reduce((product, side) => product * side, 1));
  const index = shape.map(() => 0);
  const sorted = values.slice();
  for (let i = 0; i < values.length; i++) {
    sorted[i] = values[index.reduce((sum, place, axis) => sum + place * steps[axis], 0)];
    for (let axis = shape.length - 1; axis >= 0 && ++index[axis] === shape[axis]; axis--) index[axis] = 0;
  }
  return sorted;
}
