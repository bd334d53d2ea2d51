"""Signals that staff may want to check. They cost no points, and students do not see them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from PIL import Image

from accuracy.comparison import Comparison, Picture
from renderer.assets import AssetError
from renderer.images.colors import srgb_from_linear
from renderer.math.arrays import Floats
from renderer.scenes import LoadedScene
from renderer.textures.image import build
from schemas.grading.grades import Signal
from schemas.textures import ImageTexture
from service.grading.likeness.closeness import closeness
from service.grading.likeness.marks import is_marked
from service.grading.likeness.sample_counts import MOST_SAMPLES, grain, sample_count

IDENTICAL = "identical_bytes"
CLOSE = "closer_than_noise"
CLEAN = "cleaner_than_samples"
GRAINY = "noise_without_samples"
CARRIED = "reference_in_texture"
MARKED = "marked_reference"

REDUCED_SIZE = 32, 24
"""Columns and rows of reduced pictures: enough to distinguish scenes, few enough to average noise away."""

LEAST_REDUCED_CORRELATION = 0.9
"""Least correlation of a texture and the reference, both reduced. Different scenes of the gallery, the hard
cases and the ready assignment reach 0.78 in 60 pictures."""


def signals(comparison: Comparison, *, test: str) -> tuple[Signal, ...]:
    """Signals of the test with this id, by the comparison of the submitted picture."""
    if comparison.image.sha256 == comparison.reference.sha256:
        found = {IDENTICAL: "The submitted file is the reference, byte for byte."}
    else:
        found = {
            MARKED: _marked(comparison),
            CLOSE: _close(comparison),
            CLEAN: _clean(comparison),
            GRAINY: _grainy(comparison),
        }
    return tuple(Signal(test=test, code=code, message=message) for code, message in found.items() if message)


def signals_of_scene(scene: LoadedScene, reference: Picture, *, test: str) -> tuple[Signal, ...]:
    """Signals of a test whose submission is a scene."""
    return tuple(
        Signal(
            test=test,
            code=CARRIED,
            message=f"The texture {name} of the submitted scene shows the reference: the scene may carry the "
            "picture that it should make.",
        )
        for name in _carried(scene, reference.linear)
    )


def _marked(comparison: Comparison) -> str:
    if not is_marked(comparison.image, comparison.reference):
        return ""
    return (
        "The picture has the faint mark of the reference that results show: it was made from pictures of a "
        "result. Others have the mark in one picture in a million."
    )


def _close(comparison: Comparison) -> str:
    found = closeness(comparison.image, comparison.reference)
    if found is None or not found.suspicious:
        return ""
    return (
        f"{found.near} of {found.pixels} noisy pixels have the same noise as the reference, within a quarter "
        "of its standard error. In a picture made without the reference at most 7 in 10 do, except in one "
        "picture in a million. It was made from the reference, or by the same program with the same seed."
    )


def _clean(comparison: Comparison) -> str:
    if comparison.bias.share > comparison.policy.most_bias:
        # In a wrong picture differences are largest where nothing is noisy.
        return ""
    found = sample_count(comparison.image, comparison.reference)
    if found is None or not found.suspicious:
        return ""
    return (
        "The picture is as close to the reference where samples are noisy as where they are not, closer than "
        f"{MOST_SAMPLES} random samples a pixel get. It was made from the reference, or with far more or "
        "better samples."
    )


def _grainy(comparison: Comparison) -> str:
    found = grain(comparison.image, comparison.reference, comparison.policy.tolerance)
    if found is None or not found.suspicious:
        return ""
    return (
        f"{found.grainy} of {found.blocks} blocks of 8 x 8 pixels have noise where random samples make none: "
        "it was added to the picture, or shadow rays hit the surface they start at."
    )


def _carried(scene: LoadedScene, reference: Floats) -> Iterator[str]:
    """Names of textures that show the reference, a linear picture (H, W, 3), in any orientation."""
    wanted = _reduced(reference)
    for name, texture in scene.document.textures.items():
        if isinstance(texture, ImageTexture):
            try:
                texels = build(texture, scene.assets).texels
            except AssetError:
                continue
            shown = _reduced(np.clip(texels, 0, 1))
            turned = (shown[::down, ::right] for down in (1, -1) for right in (1, -1))
            if max(float(np.mean(each * wanted)) for each in turned) >= LEAST_REDUCED_CORRELATION:
                yield name


def _reduced(linear: Floats) -> Floats:
    """A small picture of brightness as seen, with mean 0 and variance 1; all 0 for one colour."""
    seen = Image.fromarray(srgb_from_linear(linear).mean(axis=2).astype(np.float32))
    small = np.asarray(seen.resize(REDUCED_SIZE, Image.Resampling.BOX), dtype=np.float64)
    small = small - small.mean()
    deviation = small.std()
    return small / deviation if deviation > 0 else small
