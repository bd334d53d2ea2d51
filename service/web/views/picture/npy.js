// Reads the NPY files that the service writes: little-endian float32 or int32, in C order.

const HEADER = /'descr': '([^']+)', 'fortran_order': (True|False), 'shape': \(([^)]*)\)/;
const KINDS = { "<f4": Float32Array, "<i4": Int32Array };

/**
 * @param {ArrayBuffer} buffer
 * @returns {{shape: number[], values: Float32Array | Int32Array}}
 * @throws {Error} If it is any other file.
 */
export function decodeNpy(buffer) {
  const view = new DataView(buffer);
  if (view.getUint32(0) !== 0x934e554d || view.getUint8(6) !== 1)
    throw new Error("This is not an .npy file of version 1.");
  const start = 10 + view.getUint16(8, true);
  const [, kind, fortran, sides] =
    HEADER.exec(new TextDecoder("latin1").decode(buffer.slice(10, start))) ?? [];
  if (!KINDS[kind] || fortran !== "False")
    throw new Error("This .npy file has an unsupported order or type of numbers.");
  const shape = sides
    .split(",")
    .map((side) => side.trim())
    .filter(Boolean)
    .map(Number);
  const size = shape.reduce((a, b) => a * b, 1);
  return { shape, values: new KINDS[kind](buffer.slice(start, start + 4 * size)) };
}
