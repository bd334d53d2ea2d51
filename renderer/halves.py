"""Sample positions of adaptive pictures, in two independent halves.

Sample number i belongs to half i % 2 and is number i // 2 of it. Each half of a pixel is one Sobol sequence
in the pixel, one on the lens and one on every light, scrambled by itself, so that the two are
independent and their difference gives the error of their mean. The light points of a half continue from
sample to sample, in a separate order, so that positions in the pixel and on the light are uncorrelated.
"""

from dataclasses import dataclass, fields

import numpy as np

from renderer.cameras import LENS_DIMENSIONS, ThinLens, disk, shuffled
from renderer.lights.emitters import PIXEL_DIMENSIONS, Emitter
from renderer.lights.samples import LightPoints, Scatter
from renderer.math.arrays import Floats, Integers
from renderer.math.streams import Keys, keys
from renderer.samplers import PATTERNS

HALVES = 2
"""Their difference estimates the error of their mean; more and shorter parts would be less evenly
distributed."""


def places(seed: int, pixels: Integers, samples: Integers) -> tuple[Floats, Floats]:
    """Places in the pixel, (N,) each in [0, 1), of samples (N,) of pixels (N,)."""
    half, index = samples % HALVES, samples // HALVES
    return PATTERNS["sobol"](keys(seed, PIXEL_DIMENSIONS, pixels, half), index, 0)


@dataclass(frozen=True, slots=True, eq=False)
class SequenceEmitter(Emitter):
    """A light whose points continue from sample to sample of a half."""

    def points(
        self, pixels: Integers, samples: Integers, paths: Keys, dtype: np.dtype[np.floating]
    ) -> LightPoints:
        """Light points (L, n) for each bounce of each camera sample, (n,) pixel, sample and path numbers."""
        key = keys(self.seed, paths + np.uint64(1 + self.number), pixels, samples % HALVES)
        index = samples // HALVES * self.count + np.arange(self.count, dtype=np.int64)[:, None]
        a, b = PATTERNS["sobol"](key[None, :], shuffled(key[None, :], index), self.count)
        return Scatter((a - 0.5).astype(dtype), (b - 0.5).astype(dtype))


@dataclass(frozen=True, slots=True, eq=False)
class SequenceLens(ThinLens):
    """A lens with a sequence of places a half: halves of one set would be far from independent."""

    def places(self, pixels: Integers, samples: Integers) -> tuple[Floats, Floats]:
        """Places on the lens of radius 1, (N,) and (N,)."""
        key = keys(self.seed, LENS_DIMENSIONS, pixels, samples % HALVES)
        return disk(*PATTERNS["sobol"](key, shuffled(key, samples // HALVES), self.antialiasing.samples))


def lens_in_sequence(lens: ThinLens) -> SequenceLens:
    """The same lens, with one sequence of points per half."""
    return SequenceLens(**{item.name: getattr(lens, item.name) for item in fields(lens)})
