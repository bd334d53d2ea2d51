// False colours, as words of RGBA codes in the byte order of canvases.

/** @param {number} red @param {number} green @param {number} blue */
export const pack = (red, green, blue) => (0xff000000 | (blue << 16) | (green << 8) | red) >>> 0;

/** Red, green and blue of a word. @param {number} word */
export const unpack = (word) => [word & 255, (word >>> 8) & 255, (word >>> 16) & 255];

/** The colour of a pixel that has no value. */
export const GREY = pack(128, 128, 128);

const STEPS = 256;

// Every eighth colour of 256. Equal steps of value look equally large, also in grey and to colour-blind people: viridis,
// magma and inferno by Smith and van der Walt (2015), cividis by Nuñez, Anderton and Renslow (2018), all CC0.
const SAMPLES = {
  viridis:
    "440154 470d60 48186a 482374 472d7b 453681 424086 3f4989 3b528b 375a8d 33638d 2f6a8e 2c728e 297a8e 26818e 23898e " +
    "21908c 1f988b 1f9f88 21a685 28ae80 31b57b 3ebc74 4cc26c 5dc963 6ece58 82d34c 96d83f abdc32 c0df24 d5e21a eae51a fde725",
  magma:
    "000004 030311 0a0822 130d33 1d1146 28115a 36106a 430f76 50127c 5d177f 691c81 762181 822681 8f2a81 9c2e7f a9327d " +
    "b63779 c33b75 cf4170 db486a e65163 ee5c5e f5695c f9785d fb8761 fd9668 fea571 feb47b fec387 fed194 fde0a2 fceeb0 fcfdbf",
  inferno:
    "000004 040312 0b0724 150b37 210c4a 2e0a5a 3c0965 4a0c6b 57106d 63146e 70196e 7d1e6d 89226a 962766 a32b61 af315c " +
    "bb3755 c63e4d d14644 db4f3b e35932 eb6528 f1711e f67f14 f98d0a fb9c06 fcab0f fbba1f f9ca32 f5d949 f2e865 f3f586 fcffa4",
  cividis:
    "00224e 00285b 002e6a 043371 1a386f 273e6e 32436d 3b496c 434e6c 4b546c 52596d 5a5f6e 61656f 686a71 6f7073 757676 " +
    "7c7b78 848179 8b8778 938d78 9b9376 a39a75 aba072 b3a670 bbad6c c3b469 ccba64 d4c15f ddc958 e6d051 efd748 f8df3c fee838",
  grey: "000000 ffffff",
  // The heat map of the service.
  heat: "000000 5a0078 dc2828 ffbe14 ffffff",
};

/** The names of the scales that begin dark and end bright. */
export const COLORMAPS = Object.keys(SAMPLES);

/** @type {Map<string, Uint32Array>} */
const palettes = new Map();

/**
 * The colours from the lowest value to the highest.
 *
 * @param {string} name - One of `COLORMAPS`.
 * @returns {Uint32Array} 256 words.
 */
export function paletteOf(name) {
  const known = palettes.get(name);
  if (known) return known;
  const palette = between(SAMPLES[/** @type {keyof typeof SAMPLES} */ (name)].split(" ").map(parsed));
  palettes.set(name, palette);
  return palette;
}

/** @param {string} hex @returns {number[]} */
const parsed = (hex) => [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16));

/** Colours between those given, which are at equal distances. @param {number[][]} colors */
function between(colors) {
  return Uint32Array.from({ length: STEPS }, (_, step) => {
    const place = (step / (STEPS - 1)) * (colors.length - 1);
    const before = Math.min(Math.floor(place), colors.length - 2);
    const [red, green, blue] = colors[before].map((code, i) =>
      Math.round(code + (place - before) * (colors[before + 1][i] - code)),
    );
    return pack(red, green, blue);
  });
}

/**
 * A colour for an index: by the golden angle, neighbouring numbers have distant hues, and they alternate in lightness.
 *
 * @param {number} number
 */
export function named(number) {
  if (number < 0) return pack(0, 0, 0);
  const hue = (number * 137.50776405003785) % 360;
  return fromHsl(hue, 0.62, number % 2 ? 0.42 : 0.66);
}

/** @param {number} hue @param {number} saturation @param {number} lightness */
function fromHsl(hue, saturation, lightness) {
  const reach = saturation * Math.min(lightness, 1 - lightness);
  const channel = (/** @type {number} */ shift) => {
    const k = (shift + hue / 30) % 12;
    return Math.round(255 * (lightness - reach * Math.max(-1, Math.min(k - 3, 9 - k, 1))));
  };
  return pack(channel(0), channel(8), channel(4));
}
