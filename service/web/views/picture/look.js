// How a picture is shown: exposure and transfer, which channel, and whether clipped pixels are marked.

import { Encoder, INFINITE, bitsOf } from "./transfer.js";

/** What can be shown of a picture, by the index that the shader has for it; -1 is all three channels. */
export const CHANNELS = { rgb: -1, red: 0, green: 1, blue: 2, luminance: 3 };

/** @typedef {keyof typeof CHANNELS} Channel */

/**
 * @typedef {object} Look
 * @property {Encoder} encoder
 * @property {Channel} channel
 * @property {number} stripe - Pixels across a stripe over clipped pixels; 0 for none.
 */

/** @returns {Look} */
export const plainLook = () => ({ encoder: new Encoder(), channel: "rgb", stripe: 0 });

// As words of RGBA codes.
export const TOO_BRIGHT = 0xff0000ff;
export const TOO_DARK = 0xffff4000;
export const NO_NUMBER = 0xffff00ff;

/** Bits of the greatest float that is not clipped. @param {number} exposure */
export const brightest = (exposure) => Math.min(INFINITE, bitsOf(2 ** -exposure));

// Bits of the number 0 with a sign, which is the last before negative numbers.
export const NEGATIVE = 0x80000000;
// Bits without the sign.
export const MAGNITUDE = 0x7fffffff;
