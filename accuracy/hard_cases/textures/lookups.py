"""Hard cases G: where textures are looked up."""

import itertools
import math
import warnings
from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import schemas.textures as language
from accuracy.hard_cases.documents import Json, camera, mesh, phong, sampled, scene, sphere, triangle
from accuracy.hard_cases.formulas import by_dtype, plain_weights
from accuracy.hard_cases.harness import (
    DOUBLE,
    DTYPES,
    EPS,
    Cases,
    Files,
    Outcome,
    Outcomes,
    compiled,
    in_both,
    judged,
    png,
    points,
    tally,
)
from accuracy.hard_cases.triangles import on_lines
from renderer import RenderPlan
from renderer.math.arrays import Floats, dot
from renderer.textures import image
from renderer.textures.image import ImageTexture

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


def wrapped(wrap: str, index: int, size: int) -> int:
    """The number of the texel that stands at a whole place outside of the image."""
    if wrap == "clamp":
        return min(max(index, 0), size - 1)
    index %= size if wrap == "repeat" else 2 * size
    return index if index < size else 2 * size - 1 - index


def value_at(codes: list[int], filter_: str, wrap: str, u: float) -> tuple[float, float]:
    """The value at a place, in rational numbers of the double u, rounded once.

    Twice, or those of the two texels that share a border within 4 eps of a period from the place, where
    `nearest` may take either.
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


def asked(places: list[float], widths: tuple[int, ...]) -> Outcomes:
    """Look-ups at places in rows of texels, by every filter and beyond every kind of border."""
    return (_row(places, ramp(each[0]), *each[1:]) for each in itertools.product(widths, FILTERS, WRAPS))


def _row(places: list[float], codes: list[int], filter_: str, wrap: str) -> Outcome:
    """Values off by more than 16 eps times the width; the textbook knows `repeat` alone."""
    true = np.array([value_at(codes, filter_, wrap, u) for u in places])

    def errors(values: Any) -> Floats:
        return np.abs(np.reshape(values, (-1, 1)) - true).min(axis=1) / (16 * EPS * len(codes))

    row = texture(np.array([codes]), filter_, wrap)
    found = row.at(np.stack((np.array(places), np.full(len(places), 0.5))))[0]
    textbook = [[plain(codes, filter_, u, kind) for u in places] for kind in DTYPES if wrap == "repeat"]
    return judged(errors(found), *map(errors, textbook))


def tiny_negative() -> Outcomes:
    """From -1e-300 to -0.01, -0, and whole numbers below 0."""
    small = (-(10 ** np.random.default_rng(1).uniform(-20, -2, 60))).tolist()
    places = [-0.0, -5e-324, -1e-300, -1e-17, -1e-9, -1.0, -1.5, *small]
    return asked(places, (1, 2, 3, 256))


def huge() -> Outcomes:
    """Up to the largest coordinate that a scene may have."""
    rng = np.random.default_rng(2)
    spread = (rng.choice([-1, 1], 80) * 10 ** rng.uniform(3, 15, 80)).tolist()
    return asked([1e9 + 0.25, -(1e9 + 0.25), 1e15, -1e15, *spread], (1, 3, 7, 1000))


def constant() -> Iterator[Outcomes]:
    """Random places in images of one colour."""
    for number, size in enumerate(((1, 1), (1, 7), (7, 1), (2, 2), (3, 5))):
        places = np.random.default_rng(number).uniform(-3, 4, (2, 500))
        value = np.float32(77 + number) / np.float32(255)
        plain = [_weighted(places, size, dtype(value)) for dtype in DTYPES]
        for wrap in WRAPS:
            found = texture(np.full(size, 77 + number), "bilinear", wrap).at(places)[0]
            yield Outcome(500, tally(found != float(value)), *plain)


def _weighted(places: Floats, size: tuple[int, int], value: Any) -> int:
    """How often four weights times one value sum to another value."""
    kind = type(value)
    one, scaled = kind(1), places.astype(kind) * np.array([[size[1]], [size[0]]], dtype=kind)
    x, y = scaled - np.floor(scaled)
    weights = ((one - x) * (one - y), x * (one - y), (one - x) * y, x * y)
    return tally(sum(weight * value for weight in weights) != value)


UP = np.array([[0.0], [1.0], [0.0]])


def mapped(*shapes: Json, codes: NDArray[Any], filter_: str = "nearest", **material: Any) -> RenderPlan:
    """The plan of shapes with an image `map` of codes (H, W, 3)."""
    texture_ = {"type": "image", "asset": "map", "encoding": "linear", "filter": filter_, "wrap": "clamp"}
    document = scene(*shapes, textures={"map": texture_}, materials={"plain": phong(**material)})
    return compiled(document, DOUBLE, {"map": png(codes.astype(np.uint8))})


ROWS = np.arange(20, 240, 20)
"""Codes of the rows of an image, the first on the side v = 1."""


def poles() -> Iterator[Outcomes]:
    """Many balls, and rays aimed at both poles of each from within 60 degrees of the axis."""
    rng = np.random.default_rng(1)
    count = 170
    centers = np.stack((10.0 * np.arange(count), rng.uniform(-3, 3, count), rng.uniform(-3, 3, count)))
    radii = rng.uniform(0.3, 3, count)
    balls = [sphere(c, float(r)) for c, r in zip(centers.T, radii, strict=True)]
    codes = np.repeat(ROWS[:, None, None], 3, axis=2).repeat(5, axis=1)
    plan = mapped(*balls, codes=codes, filter_="bilinear", color_texture="map")
    for side, widest in itertools.product((1.0, -1.0), (0.0, 0.5, 1.5)):
        across = rng.uniform(-widest, widest, (2, count))
        directions = np.stack((*across, np.full(count, -side)))
        origins = centers + np.array([[0.0], [0.0], [side]]) * radii - 2 * radii * directions
        hits = points(plan, origins, directions)
        true = float(np.float32(ROWS[0 if side > 0 else -1] / 255))
        plain = in_both(partial(_latitudes, origins, directions, centers, radii))
        wrong = tally(hits.colors[0] != true) + count - hits.count
        yield Outcome(count, wrong, *(tally(np.isnan(latitudes)) for latitudes in plain))


def _latitudes(origins: Floats, directions: Floats, centers: Floats, radii: Floats, dtype: Any) -> Floats:
    """Latitudes (N,), from 0 to 1, as the arc cosine of a height."""
    o, d, c, r = (values.astype(dtype) for values in (origins, directions, centers, radii))
    away = o - c
    squared, half, rest = dot(d, d), dot(away, d), dot(away, away) - r * r
    t = (-half - np.sqrt(half * half - squared * rest)) / squared
    return np.arccos(-(o[2] + t * d[2] - c[2]) / r) / dtype(np.pi)


def no_numbers() -> Outcomes:
    """1,000 rays at textured triangles on lines or in a point, and 200 at each that spans no coordinates."""
    corners, origins, targets = on_lines()
    codes = np.full((4, 8, 3), 77)
    flat = mesh(
        corners.reshape(-1, 3),
        np.arange(300).reshape(-1, 3),
        uvs=np.random.default_rng(6).uniform(-2, 3, (300, 2)),
    )
    with warnings.catch_warnings(record=True) as raised:
        warnings.simplefilter("always")
        parts = [_without_coordinates(uvs, filter_, codes) for uvs in NOWHERE for filter_ in MANY_FILTERS]
        plan = mapped(flat, codes=codes, filter_="bilinear", color_texture="map")
        hits = points(plan, origins.T.copy(), (targets - origins).T.copy())
    owners = list(corners.repeat(10, axis=0).transpose(1, 0, 2))
    plain = by_dtype(plain_weights, owners, origins, targets - origins)
    return [*parts, Outcome(1000, hits.count + len(raised), *(tally(~np.isfinite(each)) for each in plain))]


NOWHERE: tuple[list[list[float]], ...] = (
    [[0.3, 0.6]] * 3,
    [[0, 0], [1, 1], [2, 2]],
    [[0.2, 0.5], [0.2, 0.5], [0.7, 0.5]],
)
"""Texture coordinates of corners in one place, on a line, and two of them in one place."""

MANY_FILTERS = (*FILTERS, "mipmap")


def _without_coordinates(uvs: list[list[float]], filter_: str, codes: NDArray[Any]) -> Outcome:
    shape = triangle([-4, 0, -4], [-4, 0, 4], [4, 0, -4], uvs=uvs)
    plan = mapped(shape, codes=codes, filter_=filter_, color_texture="map")
    x, z = np.random.default_rng(7).uniform(-3.9, -0.1, (2, 200))
    origins = np.stack((x, np.full(200, 3.0), z))
    hits = points(plan, origins, np.repeat(-UP, 200, axis=1))
    return Outcome(200, tally(hits.colors[0] != float(np.float32(77 / 255))) + 200 - hits.count)


FIELDS = 4
"""Least width of a footprint, in fields of the board, for which the case expects the mean."""


def board(texture: Json, repeats: float) -> Json:
    """A board to the horizon: a triangle of 1200 units with texture coordinates up to `repeats`."""
    ground = triangle(
        [-600, 0, 100], [600, 0, 100], [-600, 0, -1100], uvs=[[0, 0], [repeats, 0], [0, repeats]]
    )
    view = camera(position=[-150.3, 1.7, 99], look_at=[-150, 1.2, 0], width=48, height=48)
    return scene(
        ground,
        camera=view,
        textures={"map": texture},
        materials={"plain": phong(color_texture="map")},
        sampling=sampled(pattern="center"),
    )


def small_fields() -> Iterator[Outcomes]:
    """One board as a checker and as an image of two by two texels, each with its filter."""
    checker = {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0], "repeat": [2, 2], "filter": "box"}
    image_ = {"type": "image", "asset": "map", "encoding": "linear", "wrap": "repeat", "filter": "mipmap"}
    codes = np.array([[0, 255], [255, 0]])[:, :, None].repeat(3, axis=2).astype(np.uint8)
    for texture_ in (checker, image_):
        plan = compiled(board(texture_, 6000), DOUBLE, {"map": png(codes)})
        rows, columns = np.divmod(np.arange(48 * 48, dtype=np.float64), 48)
        hits = points(plan, plan.camera.position, plan.camera.directions(columns + 0.5, rows + 0.5))
        # A field is 0.1 units wide; the middle of the picture has the narrowest pixels.
        far = hits.t >= FIELDS * 0.1 / (2 * plan.camera.half_width / 48)
        yield judged(np.abs(hits.colors[0, far] - 0.5) * 32)


CASES: Cases = {
    "G1: the borders of an image": lambda: asked(
        [0.0, 1.0, -1.0, 2.0, *JUST_BELOW_1, *[k / 24 for k in range(-24, 49)]], (1, 2, 3, 12, 256)
    ),
    "G2: tiny negative coordinates": tiny_negative,
    "G3: huge coordinates": huge,
    "G4: constant images": constant,
    "G5: the poles of a ball": poles,
    "G5: texture coordinates that are no numbers": no_numbers,
    "G6: fields smaller than pixels": small_fields,
}
