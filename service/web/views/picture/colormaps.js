// False colours.

// Viridis (Smith and van der Walt 2015, matplotlib) as polynomials of degree 6 a channel, fitted by Matt Zucker ("Perlin
// for plots", 2019, public domain). Perceptually uniform, also in grey and for colour-blind people.
const VIRIDIS = [
  [
    0.2777273272234177, 0.1050930431085774, -0.3308618287255563, -4.634230498983486, 6.228269936347081,
    4.776384997670288, -5.435455855934631,
  ],
  [
    0.005407344544966578, 1.404613529898575, 0.214847559468213, -5.799100973351585, 14.17993336680509,
    -13.74514537774601, 4.645852612178535,
  ],
  [
    0.3340998053353061, 1.384590162594685, 0.09509516302823659, -19.33244095627987, 56.69055260068105,
    -65.35303263337234, 26.3124352495832,
  ],
];

const polynomial = (coefficients, x) =>
  coefficients.reduceRight((sum, coefficient) => sum * x + coefficient, 0);

/** RGB codes for 256 steps from the lowest value to the highest. */
export const viridis = Array.from({ length: 256 }, (_, step) =>
  VIRIDIS.map((channel) => Math.round(255 * Math.min(1, Math.max(0, polynomial(channel, step / 255))))),
);

// A colour for an index: by the golden angle, neighbouring numbers have distant hues, and they alternate in lightness.
export function named(number) {
  if (number < 0) return [0, 0, 0];
  const hue = (number * 137.50776405003785) % 360;
  return fromHsl(hue, 0.62, number % 2 ? 0.42 : 0.66);
}

function fromHsl(hue, saturation, lightness) {
  const reach = saturation * Math.min(lightness, 1 - lightness);
  return [0, 8, 4].map((shift) => {
    const k = (shift + hue / 30) % 12;
    return Math.round(255 * (lightness - reach * Math.max(-1, Math.min(k - 3, 9 - k, 1))));
  });
}
