"""Undo forgiven mistakes, which another test judges, before a picture is judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from accuracy.comparison import Comparison, Picture
from accuracy.comparison.diagnosis import BLURRED, JAGGED
from accuracy.comparison.mistakes import candidates
from renderer.math.arrays import Floats
from schemas.grading.acceptance import Acceptance, Verdict
from service.grading.accepting import noiseless
from service.grading.repairing import without_jags


def forgiven(accept: Acceptance, found: Comparison) -> tuple[Picture, str]:
    """The picture to judge, and a sentence about the mistake that was undone; empty if none was.

    Parameters
    ----------
    found
        A comparison of the whole picture; only a mistake that its diagnosis names is undone.
    """
    pardoned = accept.forgiven if isinstance(accept, Verdict) else ()
    cause = next((cause.cause for cause in found.causes if cause.cause in pardoned), None)
    if cause is None:
        return found.image, ""
    # Undoing a mistake changes the noise.
    picture = replace(noiseless(found.image), linear=_undone(cause, found))
    return picture, f"It is judged as if {cause} were fixed; that mistake costs no points here."


def _undone(cause: str, found: Comparison) -> Floats:
    image, reference = found.image.linear, found.reference.linear
    if cause in {JAGGED, BLURRED}:
        return without_jags(image, reference)
    mistake = next(mistake for mistake in candidates(image, reference) if mistake.cause == cause)
    return np.ascontiguousarray(mistake.undo(image))
