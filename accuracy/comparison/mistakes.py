"""Common mistakes with pictures, each with its correction.

Undoing the mistake gives the right picture, up to noise and rounding. A correction that also smooths would
bring any noisy picture closer to its reference, so it has a control that smooths at least as much and
corrects nothing.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from accuracy.comparison.inputs import Picture
from accuracy.comparison.metrics import luma_of_seen
from renderer.images.colors import linear_from_srgb, srgb_from_linear
from renderer.math.arrays import Floats

Undo = Callable[[Floats], Floats]

EXPOSURE, LUMINANCE = "exposure", "tone_mapped_luminance"

LEAST_EXPOSURE = 0.02
"""Smaller relative changes of brightness may be noise or rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Mistake:
    """One mistake.

    Attributes
    ----------
    cause : str
        A word for programs.
    hint : str
        The probable mistake and its cure, in sentences for people.
    undo : callable
        Linear picture (H, W, 3) with values 0..1 to such a picture.
    control : callable or None
        Equal smoothing that undoes nothing, to compare with; None to compare with the picture as it is.
    turns : bool
        Whether undoing only puts pixels in other places, in an array of any type.
    moves : bool
        Whether undoing reads the neighbours of a pixel.
    """

    cause: str
    hint: str
    undo: Undo
    control: Undo | None = None
    turns: bool = False
    moves: bool = False


def candidates(image: Picture, reference: Picture) -> Iterator[Mistake]:
    """Mistakes that can be tried on a picture of this shape."""
    yield from ENCODINGS
    yield from CHANNELS
    yield from TURNED
    if image.width == image.height:
        yield TRANSPOSED
    yield from SHIFTS
    yield from _exposure(image, reference)


def exposure_of(image: Picture, reference: Picture) -> float | None:
    """Factor by which a picture is too bright; None if it is not, or if too much of it is white to tell.

    The ratio of means: noise would bias a least-squares fit.
    """
    count, seen, wanted = 0, 0.0, 0.0
    for one, other in zip(image.bands(), reference.bands(), strict=True):
        whole = (one.linear < 1).all(axis=2) & (other.linear < 1).all(axis=2)
        count += int(np.count_nonzero(whole))
        seen, wanted = seen + float(one.linear[whole].sum()), wanted + float(other.linear[whole].sum())
    if 2 * count < image.width * image.height or min(seen, wanted) == 0:
        return None
    return None if abs(wanted / seen - 1) < LEAST_EXPOSURE else seen / wanted


def _exposure(image: Picture, reference: Picture) -> Iterator[Mistake]:
    scale = exposure_of(image, reference)
    if scale is not None:
        yield Mistake(EXPOSURE, exposure_hint(scale), lambda picture: np.clip(picture / scale, 0, 1))


def exposure_hint(scale: float) -> str:
    """A sentence about a picture that is `scale` times too bright."""
    return (
        f"The picture is {scale:.3g} times as bright as the reference everywhere. Look at the exposure, "
        "the colours of lights and sums over samples that are not divided by their number."
    )


def _from_power(picture: Floats) -> Floats:
    return srgb_from_linear(picture) ** 2.2


def _once(picture: Floats) -> Floats:
    return linear_from_srgb(picture).astype(np.float64)


def _from_reinhard(picture: Floats) -> Floats:
    dim = np.minimum(picture, 0.5)
    return dim / (1 - dim)


def by_luminance(linear: Floats) -> Floats:
    """A picture that was tone mapped by x / (1 + L), L the luminance of the pixel."""
    return linear / (1 + luma_of_seen(linear)[:, :, None])


def _from_luminance(picture: Floats) -> Floats:
    return np.minimum(picture / (1 - np.minimum(luma_of_seen(picture), 0.5)[:, :, None]), 1)


def _from_exponential(picture: Floats) -> Floats:
    return np.minimum(-np.log1p(-np.minimum(picture, 0.9)), 1)


def _from_aces(picture: Floats) -> Floats:
    """Invert Narkowicz's fit (2016), y = x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14)."""
    linear, square = 0.59 * picture - 0.03, 2.51 - 2.43 * picture
    return np.minimum((linear + np.sqrt(linear**2 + 0.56 * square * picture)) / (2 * square), 1)


TONE_HINT = (
    "The picture was tone mapped before it was encoded{}. Encode the linear values as they are, clipped to 1."
)


ENCODINGS = (
    Mistake(
        "gamma_missing",
        "The numbers in the file are linear but were read as sRGB. Encode them before saving, or state that "
        "the encoding is linear.",
        srgb_from_linear,
    ),
    Mistake(
        "gamma_twice",
        "The picture was encoded for the display twice, or is encoded but was read as linear. Encode it "
        "once, or state that the encoding is srgb.",
        _once,
    ),
    Mistake(
        "gamma_2.2",
        "The picture was encoded with a power of 1/2.2. sRGB is not that power: use its formula with the "
        "linear part near black.",
        _from_power,
    ),
    Mistake("tone_mapped_reinhard", TONE_HINT.format(", by x / (1 + x)"), _from_reinhard),
    Mistake(LUMINANCE, TONE_HINT.format(", by x / (1 + L) with the luminance L"), _from_luminance),
    Mistake("tone_mapped_exponential", TONE_HINT.format(", by 1 - exp(-x)"), _from_exponential),
    Mistake("tone_mapped_aces", TONE_HINT.format(" with the ACES curve"), _from_aces),
)


def _ordered(order: tuple[int, int, int]) -> Undo:
    def undo(picture: Floats) -> Floats:
        return picture[:, :, list(order)]

    return undo


# The order in which the picture's own channels are read to give red, green and blue.
CHANNELS = tuple(
    Mistake(
        f"channels_{''.join(name)}",
        f"The channels are stored in the order {', '.join(name)}. Save them as red, green, blue.",
        _ordered(tuple(name.index(channel) for channel in "rgb")),  # type: ignore[arg-type]
    )
    for name in ("bgr", "rbg", "grb", "gbr", "brg")
)

TURNED = (
    Mistake(
        "flipped_vertically",
        "The picture is upside down. Row 0 is the top one: look at the sign of y where rays are made, and at "
        "the order in which rows are written.",
        lambda picture: picture[::-1],
        turns=True,
    ),
    Mistake(
        "flipped_horizontally",
        "Left and right are swapped. Look at the cross product that gives the camera's right vector.",
        lambda picture: picture[:, ::-1],
        turns=True,
    ),
    Mistake(
        "turned_half",
        "The picture is turned by 180 degrees: both its rows and its columns are written backwards.",
        lambda picture: picture[::-1, ::-1],
        turns=True,
    ),
)

TRANSPOSED = Mistake(
    "transposed",
    "Rows and columns are swapped. The first index of an image array is the row.",
    lambda picture: picture.transpose(1, 0, 2),
    turns=True,
)


def moved(picture: Floats, right: int, down: int) -> Floats:
    """The picture moved by at most one pixel each way; pixels without a source keep their values."""
    placed = picture.copy()
    placed[_to(down), _to(right)] = picture[_to(-down), _to(-right)]
    return placed


def _to(step: int) -> slice:
    """Target slice of a side for a move by -1, 0 or 1 pixels."""
    return slice(max(step, 0), min(step, 0) or None)


def _moving(right: int, down: int) -> Undo:
    return lambda picture: moved(picture, right, down)


def _halfway(right: int, down: int) -> Undo:
    """Means of neighbours: a picture with half a pixel's offset, and half the noise."""
    return lambda picture: (picture + moved(picture, right, down)) / 2


def _smoothed(right: int, down: int) -> Undo:
    """Weights 1/4, 1/2, 1/4: less noise than means of two have, and no offset."""
    return lambda picture: picture / 2 + (moved(picture, right, down) + moved(picture, -right, -down)) / 4


HORIZONTAL = {-1: "left", 1: "right", 0: ""}
VERTICAL = {-1: "up", 1: "down", 0: ""}
OFFSETS = tuple((x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if (x, y) != (0, 0))


def _shift(x: int, y: int, step: str, undo: Undo, control: Undo | None) -> Mistake:
    where = " and ".join(filter(None, (HORIZONTAL[x], VERTICAL[y])))
    return Mistake(
        f"{'half' if control else 'one'}_pixel_{where.replace(' and ', '_')}",
        f"The picture lies {step} too far {where}. The centre of pixel i is at i + 0.5; a picture of "
        "width n ends at n, not at n - 1.",
        undo,
        control,
        moves=True,
    )


SHIFTS = tuple(
    mistake
    for x, y in OFFSETS
    for mistake in (
        _shift(x, y, "one pixel", _moving(-x, -y), None),
        _shift(x, y, "half a pixel", _halfway(-x, -y), _smoothed(-x, -y)),
    )
)
