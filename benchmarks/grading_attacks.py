"""Pictures that should earn nothing: wrong ones with a hidden mistake, empty ones, and altered references."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from PIL import Image, ImageFilter

from benchmarks.grading_programs import ASSIGNMENT, MANIFEST, TESTS, codes
from renderer.images.colors import linear_from_srgb
from service.grading.folders import Folder
from service.grading.likeness.marks import marked
from service.grading.references import reference_picture
from service.grading.settings import Run

if TYPE_CHECKING:
    from collections.abc import Callable

    from benchmarks.grading_programs import Array

    Attack = Callable[["Sheet"], Array]

BAYER = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]]) / 16 + 1 / 32
"""Thresholds of an ordered dither (Bayer 1973)."""


class Sheet(NamedTuple):
    """Material of an attack: a picture and the reference as codes (H, W, 3), and the noise of 16 samples."""

    picture: Array
    reference: Array
    noise: Array
    random: np.random.Generator

    @property
    def linear(self) -> Array:
        """The picture, linear."""
        return np.asarray(linear_from_srgb(self.picture / 255))

    @property
    def copied(self) -> Sheet:
        """The reference in place of the picture."""
        return self._replace(picture=self.reference)

    def normal(self) -> Array:
        """Normal numbers for each channel."""
        return np.asarray(self.random.standard_normal(self.picture.shape))


def sheet(name: str, picture: Array, seed: int) -> Sheet:
    """The sheet of a scene's test, with the reference as results show it."""
    folder = Folder(ASSIGNMENT.resolve(), "reference")
    reference = reference_picture(TESTS[name].reference, Run(MANIFEST, folder, folder))
    error, samples = (reference.layers[layer].astype(np.float64) for layer in ("error", "samples"))
    noise = error * np.sqrt(samples[:, :, None] / 16)
    return Sheet(picture, codes(marked(reference).linear), noise, np.random.default_rng(seed))


def _rounded(levels: Array) -> Array:
    return np.clip(np.rint(levels), 0, 255).astype(np.uint8)


def _added(deviation: float) -> Attack:
    return lambda one: _rounded(one.picture + deviation * one.normal())


def _blue(one: Sheet) -> Array:
    """Noise whose means over blocks are near 0."""
    white = one.normal()
    around = sum(np.roll(white, step, axis) for step in (1, -1) for axis in (0, 1)) / 4
    return codes(one.linear + 0.1 * (white - around))


def _salted(one: Sheet) -> Array:
    drawn = one.random.random(one.picture.shape[:2])[:, :, None]
    return np.where(drawn < 1 / 16, 0, np.where(drawn < 1 / 8, 255, one.picture)).astype(np.uint8)


def _filtered(change: ImageFilter.Filter | type[ImageFilter.Filter]) -> Attack:
    return lambda one: np.asarray(Image.fromarray(one.picture).filter(change))


def _one_bit(one: Sheet) -> Array:
    return codes(one.random.random(one.picture.shape) < one.linear)


def _ordered(one: Sheet) -> Array:
    height, width = one.picture.shape[:2]
    limits = np.tile(BAYER, (height // 4 + 1, width // 4 + 1))[:height, :width, None]
    return codes(one.linear > limits)


def _in_levels(one: Sheet) -> Array:
    return codes(np.floor(16 * one.linear + one.random.random(one.picture.shape)) / 16)


def _palette(colors: int, dither: Image.Dither) -> Attack:
    def reduced(one: Sheet) -> Array:
        image = Image.fromarray(one.picture)
        few = image.quantize(colors, Image.Quantize.MEDIANCUT)
        return np.asarray(image.quantize(palette=few, dither=dither).convert("RGB"))

    return reduced


def _diffused(one: Sheet) -> Array:
    """Each channel as black or white, the error handed on (Floyd and Steinberg 1976)."""
    channels = [Image.fromarray(np.ascontiguousarray(one.picture[:, :, k])) for k in range(3)]
    return np.dstack([np.asarray(each.convert("1").convert("L")) for each in channels])


def _jpeg(quality: int) -> Attack:
    def stored(one: Sheet) -> Array:
        file = io.BytesIO()
        Image.fromarray(one.picture).save(file, "JPEG", quality=quality)
        return np.asarray(Image.open(file))

    return stored


def _times(factor: float) -> Attack:
    return lambda one: codes(factor * one.linear)


def _folded(one: Sheet) -> Array:
    left = one.picture[:, : one.picture.shape[1] // 2]
    return np.concatenate((left, left[:, ::-1]), axis=1)


def _smeared(one: Sheet) -> Array:
    small = Image.fromarray(one.picture).resize((8, 6), Image.Resampling.BOX)
    return np.asarray(small.resize(one.picture.shape[1::-1], Image.Resampling.BICUBIC))


def _flat(value: float) -> Attack:
    return lambda one: np.full_like(one.reference, round(value))


def _after(first: Attack, then: Attack) -> Attack:
    return lambda one: then(one._replace(picture=first(one)))


def _of_copy(attack: Attack) -> Attack:
    return lambda one: attack(one.copied)


def _cut_out(one: Sheet) -> Array:
    """The middle of the reference in a wrong picture."""
    height, width = one.picture.shape[:2]
    middle = np.s_[height // 4 : -(height // 4), width // 4 : -(width // 4)]
    mixed = one.picture.copy()
    mixed[middle] = one.reference[middle]
    return mixed


def _boxed(one: Sheet) -> Array:
    """A magenta box of 16 x 8 pixels."""
    mixed = one.picture.copy()
    mixed[40:48, 56:72] = 255, 0, 255
    return mixed


def _reference(one: Sheet) -> Array:
    return one.reference


def _local_noise(one: Sheet) -> Array:
    """Noise that follows the local deviation of the reference."""
    around = [np.roll(one.reference, step, axis) for step in (-1, 0, 1) for axis in (0, 1)]
    return _rounded(one.reference + np.std(around, axis=0) * one.normal())


def _stated_noise(one: Sheet) -> Array:
    """Noise as large as that of 16 samples, by the error that the reference states."""
    return codes(one.copied.linear + one.noise * one.normal())


HIDDEN: dict[str, Attack] = {
    "Gaussian noise, 12 levels": _added(12),
    "Gaussian noise, 50 levels": _added(50),
    "uniform noise": lambda one: _rounded(one.picture + one.random.uniform(-43, 43, one.picture.shape)),
    "multiplied by 1 +- 0.3": lambda one: _rounded(one.picture * (1 + 0.3 * one.normal())),
    "blue noise": _blue,
    "salt and pepper": _salted,
    "dithered at random": _one_bit,
    "dithered in order": _ordered,
    "dithered by diffusion": _diffused,
    "dithered to 16 levels": _in_levels,
    "dithered to 16 colours": _palette(16, Image.Dither.FLOYDSTEINBERG),
    "a palette of 16 colours": _palette(16, Image.Dither.NONE),
    "a palette of 256 colours": _palette(256, Image.Dither.NONE),
    "JPEG 95": _jpeg(95),
    "JPEG 30": _jpeg(30),
    "blurred": _filtered(ImageFilter.GaussianBlur(1)),
    "median of 5 x 5": _filtered(ImageFilter.MedianFilter(5)),
    "smeared": _smeared,
    "a smear dithered at random": _after(_smeared, _one_bit),
    "left half mirrored": _folded,
    "the middle of the reference in it": _cut_out,
    "x 0.002": _times(0.002),
    "x 0.1": _times(0.1),
    "x 30": _times(30),
}
"""Attacks that hide the mistake of a wrong picture."""

EMPTY: dict[str, Attack] = {
    "white": _flat(255),
    "grey": _flat(128),
    "code 1": _flat(1),
    "the reference's mean colour": lambda one: _rounded(
        0.0 * one.reference + one.reference.mean(axis=(0, 1))
    ),
    "noise alone": lambda one: _rounded(127 + 60 * one.normal()),
}
"""Attacks without a picture."""

COPIED: dict[str, Attack] = {
    "reference": _reference,
    "reference with noise, 2 levels": _of_copy(_added(2)),
    "reference with its local deviation": _local_noise,
    "reference with the noise of 16 samples": _stated_noise,
    "reference blurred": _of_copy(_filtered(ImageFilter.GaussianBlur(0.7))),
    "reference, median of 3 x 3": _of_copy(_filtered(ImageFilter.MedianFilter(3))),
    "reference smeared": _of_copy(_smeared),
    "reference as JPEG 90": _of_copy(_jpeg(90)),
    "reference with its left half mirrored": _of_copy(_folded),
    "reference at x 0.1": _of_copy(_times(0.1)),
}
"""Attacks with the reference."""

DAMAGED: dict[str, Attack] = {"a magenta box": _boxed}
"""Damage to a right picture that must cost points."""
