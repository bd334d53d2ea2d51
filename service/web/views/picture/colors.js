// The brightness of a colour.

/** Weights of red, green and blue in luminance (ITU-R BT.709). */
const LUMA = [0.2126, 0.7152, 0.0722];

/**
 * @param {number} red
 * @param {number} green
 * @param {number} blue
 */
export const luma = (red, green, blue) => LUMA[0] * red + LUMA[1] * green + LUMA[2] * blue;
