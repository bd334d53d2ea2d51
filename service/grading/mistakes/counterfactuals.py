"""Diagnose a failed picture by reproducing likely mistakes with the reference scene.

`accuracy.comparison.diagnosis` undoes mistakes of the picture alone, such as a flip. A missing shadow cannot
be undone, but it can be reproduced: the reference scene is rendered without shadows, and if the picture is
much closer to that than to the reference, its shadows are missing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from accuracy.comparison import Comparison
from accuracy.comparison.blocks import bias
from accuracy.comparison.diagnosis import Cause, best
from accuracy.comparison.mistakes import EXPOSURE, candidates
from accuracy.comparison.ratings import MIN_GAIN_ERRORS, Rating
from renderer.math.arrays import Floats
from renderer.scenes import LoadedScene
from service.grading.mistakes.altered_scenes import Alteration, alterations
from service.grading.mistakes.altered_shading import is_lit
from service.grading.mistakes.hints import HINTS
from service.grading.mistakes.reproductions import CLOSE, GLANCE, Detail, Reproductions, reduced
from service.grading.mistakes.shadow_patterns import POINTS, acne, bands

PENUMBRAE = Detail(CLOSE.most_pixels, 1, POINTS)
"""Rays that find the penumbrae."""

LIKELY, CLOSEST = 5, 2.0
"""Mistakes that are rendered with many samples: the closest ones with few, unless they leave more than this
many times the RMSE of the very closest."""

SETTLED = 0.3
"""If undoing a mistake leaves no more than this share of the RMSE, no other is tried,"""

VAGUE = ("exposure", "pixel")
"""unless its name has one of these words: many mistakes of shading and of the camera resemble it."""

Left = tuple[Cause, Floats | None]
"""A mistake, and the difference (H, W, 3) that it leaves; None if it cannot be undone."""


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    """A picture and its reference at one size, linear (H, W, 3), against which mistakes are tried in turn.

    They agree where no more than a share of `most_bias` blocks differs by more than is allowed.
    """

    reproductions: Reproductions
    detail: Detail
    image: Floats
    reference: Floats
    allowed: Floats
    most_bias: float

    @classmethod
    def of(cls, reproductions: Reproductions, detail: Detail, found: Comparison) -> _Trial:
        """The pictures of a comparison at the size of trials."""
        image, reference, factor = found.image, found.reference, reproductions.factor(detail)
        rounding = image.rounding + reference.rounding + found.policy.tolerance
        seen, wanted, allowed = (
            reduced(values, factor) for values in (image.linear, reference.linear, rounding)
        )
        return cls(reproductions, detail, seen, wanted, allowed, found.policy.most_bias)

    def left(self, alteration: Alteration) -> Floats | None:
        """The difference from a picture with a mistake; None if too few rays are left to draw it."""
        drawn = self.reproductions.draw(alteration, self.detail)
        return None if drawn is None else self.image - drawn

    def explanations(self, likely: Iterable[Alteration]) -> Iterator[Left]:
        """The mistakes that explain the picture when they are reproduced."""
        before = self.image - self.reference
        # A picture with the samples of trials is closer to the right scene with these samples.
        grid = self.left(self.reproductions.right)
        right = before if grid is None else min(before, grid, key=_rms)
        for alteration in likely:
            left = self.left(alteration)
            if left is not None and self._explains(left, right):
                hint = HINTS[alteration.cause].format(alteration.about)
                yield Cause(alteration.cause, hint, _rms(before), _rms(left)), left

    def _explains(self, left: Floats, right: Floats) -> bool:
        rating = Rating.of([(left, right, self.allowed)])
        agrees = rating.is_sure and bias(left, self.allowed).share <= self.most_bias
        return rating.is_clear or agrees


def explain(scene: LoadedScene, found: Comparison, *, keep: Path | None = None) -> tuple[Cause, ...]:
    """Mistakes that explain a difference, undone or reproduced, the best explanation first.

    Parameters
    ----------
    scene
        The scene of the reference.
    found
        A failed comparison.
    keep
        A folder of altered pictures that other submissions share.

    Returns
    -------
    tuple of Cause
        Empty if no single mistake explains the difference, or several do equally well.
    """
    if is_certain(found.causes):
        return found.causes
    reproductions = Reproductions(scene, keep)
    close = _Trial.of(reproductions, CLOSE, found)
    if (noise := _acne(close)) is not None:
        return (noise,)
    likely = _likely(_Trial.of(reproductions, GLANCE, found))
    made = close.explanations(likely) if likely else ()
    named = dict([*_undone(found, reproductions.factor(CLOSE)), *made])
    if named or not reproductions.afford(PENUMBRAE):
        return _chosen(named, close.allowed)
    band = bands(reproductions.reduced(scene, CLOSE), close.image, close.reference)
    return () if band is None else (band,)


def is_certain(undone: Sequence[Cause]) -> bool:
    """Whether the first mistake that was undone leaves so little that none needs to be reproduced."""
    if not undone or any(word in undone[0].cause for word in VAGUE):
        return False
    return undone[0].rmse_after <= SETTLED * undone[0].rmse_before


def _acne(trial: _Trial) -> Cause | None:
    scene = trial.reproductions.scene
    if not is_lit(scene.document):
        return None
    document = scene.document.model_copy(update={"lights": ()})
    dark = trial.reproductions.draw(Alteration("", LoadedScene(document, scene.assets)), trial.detail)
    return None if dark is None else acne(dark, trial.image, trial.reference)


def _likely(trial: _Trial) -> list[Alteration]:
    """The mistakes that come closer than the right scene does with as few samples, the closest first."""
    right = trial.left(trial.reproductions.right)
    if right is None:
        return []
    tried = ((trial.left(alteration), alteration) for alteration in alterations(trial.reproductions.scene))
    errors = [(_rms(left), alteration) for left, alteration in tried if left is not None]
    closer = sorted((pair for pair in errors if pair[0] < _rms(right)), key=lambda pair: pair[0])[:LIKELY]
    return [alteration for after, alteration in closer if after <= CLOSEST * closer[0][0]]


def _undone(found: Comparison, factor: int) -> Iterator[Left]:
    image, reference = found.image, found.reference
    mistakes = {mistake.cause: mistake for mistake in candidates(image, reference)}
    for cause in found.causes:
        mistake = mistakes.get(cause.cause)
        left = None if mistake is None else reduced(mistake.undo(image.linear) - reference.linear, factor)
        yield cause, left


def _chosen(left: Mapping[Cause, Floats | None], allowed: Floats) -> tuple[Cause, ...]:
    """The best cause and those that are nearly as good; none if another mistake leaves no more than it."""
    causes = best(left)
    causes = tuple(cause for cause in causes if cause.cause != EXPOSURE) or causes
    known = [each for cause in causes if (each := left[cause]) is not None]
    if known and known[0] is left[causes[0]]:
        ratings = (Rating.of([(known[0], other, allowed)]) for other in known[1:])
        if any(rating.errors < MIN_GAIN_ERRORS for rating in ratings):
            return ()
    return causes


def _rms(difference: Floats) -> float:
    return math.sqrt(float(np.mean(difference * difference)))
