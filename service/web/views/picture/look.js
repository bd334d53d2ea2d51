// How a picture is shown: exposure and transfer, and which channel.

import { Encoder, INFINITE, bitsOf } from "./transfer.js";

/** What can be shown of a picture, by the index that the shader has for it; -1 is all three channels. */
export const CHANNELS = { rgb: -1, red: 0, green: 1, blue: 2, luminance: 3 };

/** @typedef {keyof typeof CHANNELS} Channel */

/**
 * @typedef {object} Look
 * @property {Encoder} encoder
 * @property {Channel} channel
 */

/** @returns {Look} */
export const plainLook = () => ({ encoder: new Encoder(), channel: "rgb" });

/** Bits of the greatest float that is not clipped. @param {number} exposure */
export const brightest = (exposure) => Math.min(INFINITE, bitsOf(2 ** -exposure));

// Bits without the sign.
export const MAGNITUDE = 0x7fffffff;
