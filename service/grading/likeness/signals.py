"""Signals that staff may want to check. They cost no points, and students do not see them."""

from __future__ import annotations

from collections.abc import Iterator

from accuracy.comparison import Comparison, Picture
from renderer.scenes import LoadedScene
from schemas.grading.grades import Signal
from service.grading.likeness.carried_pictures import carried
from service.grading.likeness.closeness import closeness
from service.grading.likeness.sample_counts import MOST_SAMPLES, grain, sample_count

IDENTICAL = "identical_bytes"
CLOSE = "closer_than_noise"
CLEAN = "cleaner_than_samples"
GRAINY = "noise_without_samples"
CARRIED = "reference_in_texture"


def signals(
    submitted: bytes, reference: bytes | None, comparison: Comparison, *, test: str
) -> tuple[Signal, ...]:
    """Signals of one test.

    Parameters
    ----------
    submitted
        The submitted file.
    reference
        The reference file; None if it was rendered here.
    comparison
        Comparison of the submitted picture.
    test
        Id of the test.
    """
    return tuple(_found(submitted, reference, comparison, test))


def signals_of_scene(scene: LoadedScene, reference: Picture, *, test: str) -> tuple[Signal, ...]:
    """Signals of a test whose submission is a scene."""
    return tuple(
        Signal(
            test=test,
            code=CARRIED,
            message=f"The texture {name} of the submitted scene shows the reference: the scene may carry the "
            "picture that it should make.",
        )
        for name in carried(scene, reference.linear)
    )


def _found(submitted: bytes, reference: bytes | None, comparison: Comparison, test: str) -> Iterator[Signal]:
    if submitted == reference:
        yield Signal(
            test=test,
            code=IDENTICAL,
            message="The submitted file is the reference, byte for byte.",
        )
    else:
        yield from _close(comparison, test)
        yield from _clean(comparison, test)
        yield from _grainy(comparison, test)


def _close(comparison: Comparison, test: str) -> Iterator[Signal]:
    found = closeness(comparison.image, comparison.reference)
    if found is not None and found.suspicious:
        yield Signal(
            test=test,
            code=CLOSE,
            message=f"{found.near} of {found.pixels} noisy pixels have the same noise as the reference, "
            "within a quarter of its standard error. In a picture made without the reference at most 7 in 10 "
            "do, except in one picture in a million. It was made from the reference, or by the same program "
            "with the same seed.",
        )


def _clean(comparison: Comparison, test: str) -> Iterator[Signal]:
    if comparison.bias.share > comparison.policy.most_bias:
        # In a wrong picture differences are largest where nothing is noisy.
        return
    found = sample_count(comparison.image, comparison.reference)
    if found is not None and found.suspicious:
        yield Signal(
            test=test,
            code=CLEAN,
            message="The picture is as close to the reference where samples are noisy as where they are not, "
            f"closer than {MOST_SAMPLES} random samples a pixel get. It was made from the reference, or with "
            "far more or better samples.",
        )


def _grainy(comparison: Comparison, test: str) -> Iterator[Signal]:
    found = grain(comparison.image, comparison.reference, comparison.policy.tolerance)
    if found is not None and found.suspicious:
        yield Signal(
            test=test,
            code=GRAINY,
            message=f"{found.grainy} of {found.blocks} blocks of 8 x 8 pixels have noise where random "
            "samples make none: it was added to the picture, or shadow rays hit the surface they start at.",
        )
