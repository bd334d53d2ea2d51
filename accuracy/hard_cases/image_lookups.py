"""Hard cases: where image textures are looked up."""

import math
from fractions import Fraction
from typing import Any

import numpy as np

import schemas.textures as language
from accuracy.hard_cases.cases import Outcome, Section, total
from accuracy.hard_cases.rays_seen import Files, png
from renderer.math.arrays import Floats
from renderer.textures import image
from renderer.textures.image import ImageTexture

SECTION = Section("Image look-ups")

EPS = float(np.finfo(np.float64).eps)
FILTERS = ("nearest", "bilinear")
WRAPS = ("clamp", "repeat", "mirror")
JUST_BELOW_1 = (1 - 2.0**-53, 1 - 2.0**-25, 1 - 2.0**-12)


def ramp(width: int) -> list[int]:
    """Codes of which neighbours differ, the ends most of all."""
    return [(37 * i + 11) % 256 for i in range(width)]


def texture(codes: np.ndarray, filter_: str, wrap: str) -> ImageTexture:
    """The texture of a picture file of codes (H, W) uint8."""
    document = {"type": "image", "asset": "a", "encoding": "linear", "filter": filter_, "wrap": wrap}
    content = png(np.repeat(codes.astype(np.uint8)[:, :, None], 3, axis=2))
    return image.build(language.ImageTexture.model_validate(document), Files({"a": content}))


def row(codes: list[int], filter_: str, wrap: str) -> ImageTexture:
    """The texture of a single row of codes."""
    return texture(np.array([codes]), filter_, wrap)


def wrapped(wrap: str, index: int, size: int) -> int:
    """The number of the texel that stands at a whole place outside of the image."""
    if wrap == "clamp":
        return min(max(index, 0), size - 1)
    index %= size if wrap == "repeat" else 2 * size
    return index if index < size else 2 * size - 1 - index


def exact(codes: list[int], filter_: str, wrap: str, u: float) -> tuple[float, float]:
    """The value at a place, in rational numbers of the double u, rounded once.

    Twice, or that of the two texels that meet within 4 eps of a period from the place, where `nearest` is a
    matter of opinion.
    """
    texels = [Fraction(float(np.float32(code) / np.float32(255))) for code in codes]
    size = len(codes)
    if filter_ == "nearest":
        near = (Fraction(u) - Fraction(4 * EPS), Fraction(u) + Fraction(4 * EPS))
        low, high = (texels[wrapped(wrap, math.floor(place * size), size)] for place in near)
        return float(low), float(high)
    place = Fraction(u) * size - Fraction(1, 2)
    whole = math.floor(place)
    a, b = (texels[wrapped(wrap, number, size)] for number in (whole, whole + 1))
    value = float(a + (place - whole) * (b - a))
    return value, value


def plain(codes: list[int], filter_: str, u: float, dtype: Any) -> float:
    """As textbooks have it under repeat: the fraction of u times the width, NaN for a texel that is none."""
    texels = np.array(codes, dtype=np.float32) / np.float32(255)
    size, place = len(codes), dtype(u) - np.floor(dtype(u))
    if filter_ == "nearest":
        return _texel(texels, int(place * dtype(size)))
    x = place * dtype(size) - dtype(0.5)
    low = int(np.floor(x))
    share = float(x) - low
    return _texel(texels, low) * (1 - share) + _texel(texels, low + 1) * share


def _texel(texels: np.ndarray, index: int) -> float:
    return float(texels[index]) if 0 <= index < texels.size else math.nan


def asked(places: list[float], widths: tuple[int, ...], allowed: float) -> Outcome:
    """Look-ups at places in rows of texels, by every filter and beyond every kind of border."""
    return total(
        _row_asked(places, ramp(width), filter_, wrap, allowed * width)
        for width in widths
        for filter_ in FILTERS
        for wrap in WRAPS
    )


def _row_asked(places: list[float], codes: list[int], filter_: str, wrap: str, allowed: float) -> Outcome:
    true = np.array([exact(codes, filter_, wrap, u) for u in places])

    def off(values: Any) -> Floats:
        return np.abs(np.reshape(values, (-1, 1)) - true).min(axis=1) / allowed

    found = row(codes, filter_, wrap).at(np.stack((np.array(places), np.full(len(places), 0.5))))[0]
    errors = off(found)
    textbook: list[int | None] = [None, None]
    if wrap == "repeat":
        by_kind = [[plain(codes, filter_, u, kind) for u in places] for kind in (np.float64, np.float32)]
        textbook = [int(np.count_nonzero(~(off(values) <= 1))) for values in by_kind]
    return Outcome(
        tried=len(places),
        wrong=int(np.count_nonzero(~(errors <= 1))),
        textbook=textbook[0],
        textbook_single=textbook[1],
        worst=float(errors[errors <= 1].max(initial=0)),
    )


@SECTION.case(
    "the borders of an image",
    symptom="A seam where a repeated image meets itself, or an IndexError at u = 1.",
    cause="u = 1 is the texel after the last one, and half of the bilinear texels at a border stand outside.",
    remedy="Places become whole numbers of texels first, and then whole numbers are clamped, repeated or "
    "mirrored.",
    expected="The value of rational numbers, within 16 eps times the width, at 0, at 1, just below 1, and on "
    "texel centres and edges.",
    source="geometry",
)
def borders() -> Outcome:
    """0, 1, just below, every half texel, one period to each side."""
    halves = [k / 24 for k in range(-24, 49)]
    return asked([0.0, 1.0, -1.0, 2.0, *JUST_BELOW_1, *halves], (1, 2, 3, 12, 256), 16 * EPS)


@SECTION.case(
    "tiny negative coordinates",
    symptom="An IndexError, or a wrong line of texels, just before u = 0.",
    cause="u - floor(u) rounds to 1 for a small negative u, and 1 is the texel after the last one.",
    remedy="What rounds to a whole period is wrapped as a whole number.",
    expected="The value of rational numbers, within 16 eps times the width.",
    source="geometry",
)
def tiny_negative() -> Outcome:
    """From -1e-300 to -0.01, -0, and whole numbers below 0."""
    small = (-(10 ** np.random.default_rng(1).uniform(-20, -2, 60))).tolist()
    places = [-0.0, -5e-324, -1e-300, -1e-17, -1e-9, -1.0, -1.5, *small]
    return asked(places, (1, 2, 3, 256), 16 * EPS)


@SECTION.case(
    "huge coordinates",
    symptom="Textures that repeat many thousand times become blocks, then a single colour.",
    cause="u times the width has no digits left for the place within the image.",
    remedy="u is reduced to two periods first, which is exact in float64.",
    expected="The value of rational numbers of the same u, within 16 eps times the width, up to 1e15.",
    source="geometry",
)
def huge() -> Outcome:
    """Up to the largest coordinate that a scene may have."""
    rng = np.random.default_rng(2)
    spread = (rng.choice([-1, 1], 80) * 10 ** rng.uniform(3, 15, 80)).tolist()
    return asked([1e9 + 0.25, -(1e9 + 0.25), 1e15, -1e15, *spread], (1, 3, 7, 1000), 16 * EPS)


@SECTION.case(
    "constant images",
    symptom="A plain surface with a bilinear texture shows a faint pattern.",
    cause="The four weights of a bilinear look-up sum to 1 only up to rounding.",
    remedy="Values are mixed as a + f (b - a), which is a wherever a and b are the same.",
    expected="The constant, bit for bit, in images down to 1 x 1.",
    source="geometry",
)
def constant() -> Outcome:
    """Random places in images of one colour."""
    parts = []
    for number, size in enumerate(((1, 1), (1, 7), (7, 1), (2, 2), (3, 5))):
        code = 77 + number
        places = np.random.default_rng(number).uniform(-3, 4, (2, 500))
        value = np.float32(code) / np.float32(255)
        for wrap in WRAPS:
            found = texture(np.full(size, code), "bilinear", wrap).at(places)[0]
            parts.append(
                Outcome(
                    500,
                    wrong=int(np.count_nonzero(found != float(value))),
                    textbook=_weighted(places, size, np.float64(value)),
                    textbook_single=_weighted(places, size, value),
                )
            )
    return total(parts)


def _weighted(places: Floats, size: tuple[int, int], value: Any) -> int:
    """How often four weights times one value sum to another value."""
    kind = type(value)
    one, scaled = kind(1), places.astype(kind) * np.array([[size[1]], [size[0]]], dtype=kind)
    x, y = scaled - np.floor(scaled)
    weights = ((one - x) * (one - y), x * (one - y), (one - x) * y, x * y)
    return int(np.count_nonzero(sum(weight * value for weight in weights) != value))
