"""Mistakes that a program may make in every picture it writes, what its pictures then show, and their price.

One mistake can be made in the right picture, which has no noise, or undone in the wrong one. The first shows
which mistakes were made; the second gives a picture to judge.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison.mistakes import CHANNELS, ENCODINGS, LUMINANCE, TRANSPOSED, TURNED, by_luminance
from renderer.images.colors import linear_from_srgb, srgb_from_linear
from renderer.math.arrays import Floats
from service.grading.displacements import Displacement, thinned

KINDS = ("encoding", "orientation", "channels", "exposure", "ambient", "offset", "antialiasing")
"""Kinds of mistakes; a program makes at most one of each kind."""

MISTAKES = {mistake.cause: mistake for mistake in (*ENCODINGS, *CHANNELS, *TURNED, TRANSPOSED)}

CODES = 1 << 13
"""Entries of the tables of wrong encodings: they are closer together than those of 8 bits by far."""


LEAST_SCALE, MOST_SCALE = 0.25, 4.0
"""Exposures that are undone: beyond, codes of 8 bits are too coarse, or too many pixels are white."""


def is_undone(scale: float) -> bool:
    """Whether a picture so many times too bright can be judged without that."""
    return LEAST_SCALE <= scale <= MOST_SCALE


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """A picture of a program, and what it should be.

    Attributes
    ----------
    image, reference : (H, W, 3) float64
        Linear, 0 to 1.
    allowed : (H, W, 3) float64
        Mean difference of a block that is no reason.
    ambient : (H, W, 3) float64 or None
        The part of the reference that is its ambient term, linear; None where it is unknown.
    step : int
        Image and `allowed` have only every so many rows and columns of the reference (`thinned`).
    """

    image: Floats
    reference: Floats
    allowed: Floats
    ambient: Floats | None = None
    step: int = 1

    def thinned(self, most_pixels: int) -> "Pair":
        """The pair with so few pixels of its picture, in all parts of it."""
        height, width = self.image.shape[:2]
        step = math.ceil(math.sqrt(height * width / most_pixels))
        # With an odd step the pixels of a picture that is turned over are the same.
        step += step % 2 == 0
        image, allowed = thinned(self.image, step), thinned(self.allowed, step)
        return replace(self, image=image, allowed=allowed, step=step)


@dataclass(frozen=True, slots=True)
class Program:
    """A program and its mistakes, None where it makes none of a kind.

    Attributes
    ----------
    encoding, orientation, channels : str or None
        Causes of `mistakes`.
    scale : float
        How many times too bright its pictures are.
    lightless : bool
        Whether it leaves out the ambient term.
    offset : Displacement or None
    """

    encoding: str | None = None
    orientation: str | None = None
    channels: str | None = None
    scale: float = 1.0
    lightless: bool = False
    offset: Displacement | None = None

    def kinds(self) -> tuple[str, ...]:
        """The kinds of its mistakes."""
        made = (self.encoding, self.orientation, self.channels, self.scale != 1, self.lightless, self.offset)
        return tuple(kind for kind, mistake in zip(KINDS, made, strict=False) if mistake)

    def without(self, *kinds: str) -> "Program":
        """The program without its mistakes of these kinds."""
        right = Program()
        names = [{"exposure": "scale", "ambient": "lightless"}.get(kind, kind) for kind in kinds]
        changes: dict[str, Any] = {name: getattr(right, name) for name in names}
        return replace(self, **changes)

    def facing(self, image: Floats) -> Floats:
        """A picture with its rows, columns and channels in order."""
        for cause in (self.orientation, self.channels):
            if cause is not None and _fits(cause, image):
                image = MISTAKES[cause].undo(image)
        return image

    def emitted(self, pair: Pair) -> Floats:
        """Linear values of its picture before encoding, with rows and channels in order."""
        dark = pair.ambient if self.lightless else None
        if self.offset is not None:
            shown = self.offset.of(pair.reference if dark is None else pair.reference - dark, pair.step)
        else:
            shown = thinned(pair.reference, pair.step)
            shown = shown if dark is None else shown - thinned(dark, pair.step)
        return np.clip(shown if self.scale == 1 else shown * self.scale, 0, 1)

    def predicted(self, pair: Pair) -> Floats:
        """Linear values of its picture as it is read, with rows and channels in order."""
        return encoded(self.encoding, self.emitted(pair))

    def undone(self, image: Floats, reference: Floats, ambient: Floats | None) -> Floats:
        """A picture without its mistakes other than an offset, linear, 0 to 1.

        Parameters
        ----------
        reference
            What it should be: where the picture was too bright for its file, it is taken to be right.
        ambient
            What is missing in it.
        """
        image = self.facing(image)
        if self.encoding is not None:
            image = MISTAKES[self.encoding].undo(image)
        if self.scale != 1:
            full = np.minimum(image, 1) >= 1
            image = image / self.scale
            image = np.where(full, np.maximum(image, reference), image)
        if self.lightless and ambient is not None:
            image = image + ambient
        return np.clip(image, 0, 1)


_WRITTEN: dict[str, Callable[[Floats], NDArray[np.floating]]] = {
    "gamma_missing": linear_from_srgb,
    "gamma_twice": srgb_from_linear,
    "gamma_2.2": lambda linear: linear_from_srgb(linear ** (1 / 2.2)),
    "tone_mapped_reinhard": lambda linear: linear / (1 + linear),
    "tone_mapped_exponential": lambda linear: -np.expm1(-linear),
    "tone_mapped_aces": lambda x: np.minimum(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 1),
}
"""Values read from a wrongly encoded file, as functions of linear values 0..1 of a channel."""

_TABLES = {
    # Closer together near black, where encodings are steep.
    cause: written(np.linspace(0, 1, CODES) ** 2).astype(np.float64)
    for cause, written in _WRITTEN.items()
}


def encoded(encoding: str | None, linear: Floats) -> Floats:
    """Linear values after they were encoded wrongly and decoded as sRGB."""
    if encoding is None:
        return linear
    if encoding == LUMINANCE:
        return by_luminance(linear)
    entries = np.rint(np.sqrt(linear) * (CODES - 1)).astype(np.intp)
    return _TABLES[encoding].take(entries)


def _fits(orientation: str, image: Floats) -> bool:
    return orientation != TRANSPOSED.cause or image.shape[0] == image.shape[1]


def orientations(pairs: Sequence[Pair]) -> list[str]:
    """Wrong orientations that can be tried on these pictures."""
    causes = [mistake.cause for mistake in (*TURNED, TRANSPOSED)]
    return [cause for cause in causes if all(_fits(cause, pair.image) for pair in pairs)]


@dataclass(frozen=True, slots=True)
class ProgramMistake:
    """A mistake that a program makes in all its pictures.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    shows : frozenset of str
        Ids of tests in whose pictures it shows.
    charged : tuple of str
        Ids of tests in which it costs points, as the manifest lists them; empty until it is charged.
    """

    kind: str
    cause: str
    hint: str
    shows: frozenset[str]
    charged: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ProgramMistakes:
    """The mistakes of one program.

    The program has all of them but missing anti-aliasing.
    """

    program: Program
    found: tuple[ProgramMistake, ...]

    def charged(self, test_id: str) -> tuple[ProgramMistake, ...]:
        """Mistakes that cost points in a test."""
        return tuple(each for each in self.found if test_id in each.charged and test_id in each.shows)

    def undone(self, test_id: str) -> tuple[ProgramMistake, ...]:
        """Mistakes without which the picture of a test is judged."""
        return tuple(each for each in self.found if test_id in each.shows and test_id not in each.charged)

    def made(self, mistakes: Sequence[ProgramMistake]) -> Program:
        """A program that makes only these mistakes."""
        kept = {each.kind for each in mistakes}
        return self.program.without(*(kind for kind in self.program.kinds() if kind not in kept))


NONE = ProgramMistakes(Program(), ())
"""A program without mistakes of its own, or one of which nothing is known."""
