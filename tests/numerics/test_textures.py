"""Textures: look-ups against rational numbers, poles, lost coordinates; normal maps that say nothing."""

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import schemas.textures as language
from renderer import RenderPlan
from renderer.math.arrays import dot, unit
from renderer.shapes.frames import frame_of_normals
from renderer.textures import image
from renderer.textures.image import ImageTexture
from tests.documents import Json, phong, rectangle, scene, sphere, triangle
from tests.numerics.tracing import EPS, UP, points
from tests.pictures.parts import DOUBLE, Files, plan_of, png

FILTERS = pytest.mark.parametrize("filter_", ["nearest", "bilinear"])
WRAPS = pytest.mark.parametrize("wrap", ["clamp", "repeat", "mirror"])


def texture(codes: Any, filter_: str, wrap: str) -> ImageTexture:
    """The texture of a picture file of codes (H, W) uint8."""
    document = {"type": "image", "asset": "a", "encoding": "linear", "filter": filter_, "wrap": wrap}
    content = png(np.repeat(np.array(codes).astype(np.uint8)[:, :, None], 3, axis=2))
    return image.build(language.ImageTexture.model_validate(document), Files({"a": content}))


def wrapped(wrap: str, index: int, size: int) -> int:
    """The number of the texel that stands at a whole place outside of the image."""
    if wrap == "clamp":
        return min(max(index, 0), size - 1)
    index %= size if wrap == "repeat" else 2 * size
    return index if index < size else 2 * size - 1 - index


def values_at(codes: Sequence[int], filter_: str, wrap: str, u: float) -> tuple[float, float]:
    """The value at the double u, rounded once, twice; for `nearest` those within 4 eps of a period."""
    texels, size = [Fraction(float(np.float32(code) / np.float32(255))) for code in codes], len(codes)
    if filter_ == "nearest":
        near = (Fraction(u) - Fraction(4 * EPS), Fraction(u) + Fraction(4 * EPS))
        low, high = (texels[wrapped(wrap, math.floor(place * size), size)] for place in near)
        return float(low), float(high)
    place = Fraction(u) * size - Fraction(1, 2)
    whole = math.floor(place)
    a, b = (texels[wrapped(wrap, number, size)] for number in (whole, whole + 1))
    value = float(a + (place - whole) * (b - a))
    return value, value


DRAWN = np.random.default_rng(2)
PLACES = {
    "borders": [0.0, 1.0, -1.0, 2.0, 1 - 2.0**-53, 1 - 2.0**-25, *[k / 24 for k in range(-24, 49)]],
    "just below 0": [-0.0, -5e-324, -1e-300, -1e-17, -1e-9, -1.5, *-(10 ** DRAWN.uniform(-20, -2, 40))],
    "huge": [
        1e9 + 0.25,
        -1e9 - 0.25,
        1e15,
        -1e15,
        *(10 ** DRAWN.uniform(3, 15, 40)),
        *-(10 ** DRAWN.uniform(3, 15, 40)),
    ],
}


@FILTERS
@WRAPS
@pytest.mark.parametrize("where", PLACES)
def test_texel_is_that_of_exact_coordinates(where: str, wrap: str, filter_: str) -> None:
    """Within 16 eps times the width; neighbours differ, the ends most of all."""
    places = [float(u) for u in PLACES[where]]
    for width in (1, 2, 3, 7, 256):
        codes = [(37 * i + 11) % 256 for i in range(width)]
        found = texture([codes], filter_, wrap).at(np.stack((places, np.full(len(places), 0.5))))[0]
        true = np.array([values_at(codes, filter_, wrap, u) for u in places])
        assert np.abs(found[:, None] - true).min(axis=1).max() <= 16 * EPS * width


@WRAPS
@pytest.mark.parametrize("size", [(1, 1), (1, 7), (2, 2), (3, 5)])
def test_constant_texture_is_constant_bit_for_bit(size: tuple[int, int], wrap: str) -> None:
    places = np.random.default_rng(size).uniform(-3, 4, (2, 500))
    found = texture(np.full(size, 77), "bilinear", wrap).at(places)
    assert (found == float(np.float32(77) / np.float32(255))).all()


def mapped(*shapes: Json, codes: Any, filter_: str = "nearest", **material: Any) -> RenderPlan:
    """The plan of shapes with an image `map` of codes (H, W, 3)."""
    texture_ = {"type": "image", "asset": "map", "encoding": "linear", "filter": filter_, "wrap": "clamp"}
    document = scene(*shapes, textures={"map": texture_}, materials={"plain": phong(**material)})
    return plan_of(document, DOUBLE, files={"map": png(codes.astype(np.uint8))})


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["upper", "lower"])
def test_pole_of_a_ball_has_the_colour_of_its_row(side: float) -> None:
    """Many balls, and rays at the pole from within 60 degrees of the axis."""
    rng, count, rows = np.random.default_rng(1), 100, np.arange(20, 240, 20)
    centers = np.stack((10.0 * np.arange(count), rng.uniform(-3, 3, count), rng.uniform(-3, 3, count)))
    radii = rng.uniform(0.3, 3, count)
    balls = [sphere(c, float(r)) for c, r in zip(centers.T, radii, strict=True)]
    codes = np.repeat(rows[:, None, None], 3, axis=2).repeat(5, axis=1)
    plan = mapped(*balls, codes=codes, filter_="bilinear", color_texture="map")
    for widest in (0.0, 0.5, 1.5):
        directions = np.stack((*rng.uniform(-widest, widest, (2, count)), np.full(count, -side)))
        origins = centers + np.array([[0.0], [0.0], [side]]) * radii - 2 * radii * directions
        hits = points(plan, origins, directions)
        assert hits.count == count
        assert (hits.colors[0] == float(np.float32(rows[0 if side > 0 else -1] / 255))).all()


NOWHERE = {
    "in one place": [[0.3, 0.6]] * 3,
    "on a line": [[0, 0], [1, 1], [2, 2]],
    "two in one place": [[0.2, 0.5], [0.2, 0.5], [0.7, 0.5]],
}


@pytest.mark.parametrize("filter_", ["nearest", "bilinear", "mipmap"])
@pytest.mark.parametrize("uvs", NOWHERE.values(), ids=NOWHERE)
def test_coordinates_without_area_show_the_texture(uvs: Any, filter_: str) -> None:
    shape = triangle([-4, 0, -4], [-4, 0, 4], [4, 0, -4], uvs=uvs)
    plan = mapped(shape, codes=np.full((4, 8, 3), 77), filter_=filter_, color_texture="map")
    x, z = np.random.default_rng(7).uniform(-3.9, -0.1, (2, 200))
    hits = points(plan, np.stack((x, np.full(200, 3.0), z)), np.repeat(-UP, 200, axis=1))
    assert hits.count == 200
    assert (hits.colors[0] == float(np.float32(77 / 255))).all()


FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
SILENT = 1e-3
"""Squared length of a decoded texel below which it is no direction: grey 128 has 4.6e-5."""


def texels() -> Any:
    """Texels (1, N, 3): all greys near the middle, flat, inward, black ones, and random ones."""
    near = np.stack(np.meshgrid(*[np.arange(125, 132)] * 3), axis=-1).reshape(-1, 3)
    special = [(128, 128, 255), (0, 0, 0), (128, 128, 0), (255, 0, 0), (0, 0, 255), (255, 255, 255)]
    return np.vstack((near, special, np.random.default_rng(2).integers(0, 256, (300, 3))))[None]


@pytest.mark.parametrize("viewer", [[0.1, 0.9, -0.2], [0.7, 0.3, 0.4]], ids=["from above", "aslant"])
def test_texel_that_says_nothing_bends_nothing(viewer: list[float]) -> None:
    """All others do as their decoded direction says, bent to the horizon where it faces away."""
    codes = texels()
    count = codes.shape[1]
    targets = np.stack((np.zeros(count), np.zeros(count), -4 + 8 * (np.arange(count) + 0.5) / count))
    decoded = (2 * (codes[0].T / np.float32(255)).astype(np.float32).astype(np.float64) - 1)[[1, 2, 0]]
    viewers = np.repeat(unit(np.array(viewer)[:, None]), count, axis=1)
    true = np.where(dot(decoded, decoded) < SILENT, UP, unit(decoded))
    cosines = dot(true, viewers)
    sines = np.where(cosines < 0, np.sqrt((1 - cosines) * (1 + cosines)), 1.0)
    true = np.where(cosines < 0, unit(true - viewers * cosines), true)
    normals = points(
        mapped(FLOOR, codes=codes, normal_map="map"), targets + viewers, -viewers
    ).shading_normals
    assert (np.abs(normals - true).max(axis=0) <= 16 * EPS / sines).all()
    flat = (codes[0] == (128, 128, 255)).all(axis=1)
    assert (normals[1, flat] >= np.cos(np.radians(0.4))).all()


def test_frame_near_the_lower_pole_is_orthonormal() -> None:
    """1e-7 to 0.1 from straight down, straight down itself, and the normal that pbrt tests."""
    rng = np.random.default_rng(4)
    tilt, turn = 10 ** rng.uniform(-7, -1, 1000), rng.uniform(0, 2 * np.pi, 1000)
    down = np.stack((np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), -np.cos(tilt)))
    known = np.array([[0.0, -0.0, 0.00038527316], [0.0, 0.0, 0.00038460016], [-1.0, -1.0, -0.99999988079]])
    normals = np.hstack((down, unit(known)))
    tangents = frame_of_normals(normals)
    assert np.abs(dot(tangents, normals)).max() <= 8 * EPS
    assert np.abs(dot(tangents, tangents) - 1).max() <= 8 * EPS


@pytest.mark.parametrize("uvs", [[[0, 0], [1, 0], [0, 1]], [[0.5, 0.5]] * 3, [[0, 0], [1, 1], [2, 2]]])
def test_tangent_that_says_nothing_still_makes_a_frame(uvs: Any) -> None:
    """Smooth normals within 1e-7 of the tangent or on it, and uv on a point or a line."""
    rng, texel = np.random.default_rng(5), np.array([200, 150, 225])
    decoded = 2 * (texel / 255).astype(np.float32).astype(np.float64) - 1
    height = decoded[2] / np.sqrt(decoded @ decoded)
    for number in range(20):
        aside = unit(np.array([[rng.normal()], [abs(rng.normal())], [0.0]]))
        smooth = unit(np.array([[0.0], [0.0], [1.0]]) + (0.0, 10 ** rng.uniform(-16, -7))[number % 2] * aside)
        shape = triangle([-1, 0, -1], [-1, 0, 1], [1, 0, -1], uvs=uvs, normals=[smooth[:, 0]] * 3)
        viewer = unit(smooth + 0.3 * UP)
        plan = mapped(shape, codes=texel[None, None], normal_map="map")
        targets = np.stack((rng.uniform(-0.9, 0, 8), np.zeros(8), rng.uniform(-0.9, 0, 8)))
        normal = points(plan, targets + viewer, np.repeat(-viewer, 8, axis=1)).shading_normals
        assert np.abs(dot(normal, smooth) - height).max() <= 16 * EPS
        assert np.abs(dot(normal, normal) - 1).max() <= 16 * EPS
