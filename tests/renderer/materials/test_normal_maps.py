"""Normal maps follow the texture coordinates, mirrored ones too, from either side."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from schemas.quality import TargetQuality
from tests.documents import Json, bulb, camera, dark_scene, ellipsoid, mesh, phong, rectangle, triangle
from tests.pictures.parts import DOUBLE, plan_of, png, samples_of

Vector = NDArray[np.float64]
Field = Callable[[float, float], Vector]
"""The place of texture coordinates (u, v)."""
TEXEL = np.array([190, 150, 235], dtype=np.uint8)
DECODED = 2 * (TEXEL / 255).astype(np.float32).astype(np.float64) - 1
FILES = {"n.png": png(TEXEL[None, None])}
IMAGES = {"n": {"type": "image", "asset": "n.png", "encoding": "linear"}}
STEP = 2.0**-20


def skew(u: float, v: float) -> Vector:
    """Neither of one length nor perpendicular."""
    return np.array([-1.0, -1.2, 0.3]) + u * np.array([2.2, 0.4, -0.3]) + v * np.array([0.9, 2.5, 0.5])


AXES = np.array([[0.9, 0.0, 0.3], [-0.2, 0.7, 0.6], [0, 0, 0]])
AXES[1] -= AXES[0] * (AXES[0] @ AXES[1]) / (AXES[0] @ AXES[0])
AXES[2] = 0.8 * np.cross(AXES[0], AXES[1])


def round_(axes: Any) -> Field:
    """Longitude about the third axis, starting at the first, and latitude, starting below."""

    def field(u: float, v: float) -> Vector:
        a, b, c = np.asarray(axes, dtype=np.float64)
        ring = math.cos(2 * math.pi * u) * a + math.sin(2 * math.pi * u) * b
        return math.sin(math.pi * v) * ring - math.cos(math.pi * v) * c

    return field


UVS = [[0.1, 0.2], [0.9, 0.1], [0.4, 0.9]]
TURNED = [UVS[i] for i in (0, 2, 1)]


def corners(field: Field, uvs: list[list[float]]) -> list[list[float]]:
    return [field(*uv).tolist() for uv in uvs]


def mirrored(field: Field, factors: list[float]) -> Field:
    return lambda u, v: field(u, v) * factors


MIRROR = [-1.5, 1.0, 0.5]
TILE = mesh(corners(skew, UVS), [[0, 1, 2]], uvs=UVS)
OUTWARD = np.cross(skew(1, 0) - skew(0, 0), skew(0, 1) - skew(0, 0))
BENT = [0.2, 0.1, 1.0]
SHAPES: dict[str, tuple[Json, Field, Any]] = {
    "triangle": (triangle(*corners(skew, UVS), uvs=UVS), skew, OUTWARD),
    "triangle, mirrored": (triangle(*corners(skew, TURNED), uvs=TURNED), skew, -OUTWARD),
    "smooth triangle, mirrored": (
        triangle(*corners(skew, TURNED), uvs=TURNED, normals=[[-x for x in BENT]] * 3),
        skew,
        [-x for x in BENT],
    ),
    "mesh, mirrored": (mesh(corners(skew, TURNED), [[0, 1, 2]], uvs=TURNED), skew, -OUTWARD),
    "mesh, negative scale": (TILE | {"scale": MIRROR}, mirrored(skew, MIRROR), OUTWARD / MIRROR),
    "parallelogram, edges exchanged": (
        rectangle(skew(0, 0), skew(0, 1) - skew(0, 0), skew(1, 0) - skew(0, 0)),
        lambda u, v: skew(v, u),
        -OUTWARD,
    ),
    "rectangle by its centre": (
        {"type": "rectangle", "center": [0, 0, 0], "normal": [0, 0, 1], "tangent": [1, 0, 0], "size": [2, 3],
         "material": "plain"},
        lambda u, v: np.array([2 * u - 1, 3 * v - 1.5, 0.0]),
        [0, 0, 1],
    ),
    "ellipsoid": (ellipsoid([0, 0, 0], *AXES), round_(AXES), None),
    "ellipsoid, left-handed axes": (ellipsoid([0, 0, 0], *AXES[[1, 0, 2]]), round_(AXES[[1, 0, 2]]), None),
}  # fmt: skip


def frame(field: Field, outward: Any, u: float, v: float) -> tuple[Vector, Vector, Vector]:
    """Orthonormal directions of growing u and of growing v, and the outward normal."""
    by_u = field(u + STEP, v) - field(u - STEP, v)
    by_v = field(u, v + STEP) - field(u, v - STEP)
    if outward is None:
        outward = np.cross(by_u, by_v)
        outward = outward * np.sign(outward @ field(u, v))
    normal = outward / np.linalg.norm(outward)
    tangent = by_u - normal * (normal @ by_u)
    tangent /= np.linalg.norm(tangent)
    cotangent = by_v - normal * (normal @ by_v) - tangent * (tangent @ by_v)
    return tangent, cotangent / np.linalg.norm(cotangent), normal


def lit(shape: Json, eye: Vector, place: Vector) -> tuple[Json, Vector]:
    """A scene of one pixel that looks at a place beside bulbs of three colours, and the bulbs' directions."""
    view = (eye - place) / np.linalg.norm(eye - place)
    aside = np.cross(view, [0.3, 0.5, 0.8])
    beside = np.cross(view, aside)
    ways = np.array([view + 0.4 * aside, view - 0.4 * aside + 0.3 * beside, view - 0.4 * beside])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    document = dark_scene(
        shape,
        camera=camera(position=eye, look_at=place, up=[0.1, 1, 0.2], vertical_fov=1e-6, width=1, height=1),
        lights=[bulb(place + 0.1 * way, color) for way, color in zip(ways, np.eye(3).tolist(), strict=True)],
        textures=IMAGES,
        materials={"plain": phong([1, 1, 1], ambient=0, diffuse=1, normal_map="n")},
    )
    return document, ways


def seen_normal(radiance: Any, ways: Vector) -> Vector:
    """The normal whose cosines with three directions are the three channels."""
    assert (radiance > 0).all()
    return np.linalg.solve(ways, radiance)


@pytest.mark.parametrize("behind", [False, True], ids=["front", "behind"])
@pytest.mark.parametrize("name", SHAPES)
def test_normal_map_bends_towards_growing_u_and_v(name: str, behind: bool) -> None:
    """1e-9: differences of the field over 2^-20 are off by less, and so is the double-precision pixel."""
    shape, field, outward = SHAPES[name]
    u, v = 0.45, 0.4
    tangent, cotangent, normal = frame(field, outward, u, v)
    place = field(u, v)
    if behind and outward is None:
        eye = place * 0.5
    else:
        eye = place + (-2 if behind else 2) * (normal + 0.1 * tangent)
    document, ways = lit(shape, eye, place)
    expected = DECODED[0] * tangent + DECODED[1] * cotangent + DECODED[2] * normal
    expected *= (-1 if behind else 1) / np.linalg.norm(expected)
    found = seen_normal(samples_of(plan_of(document, DOUBLE, files=FILES))[0, 0, 0], ways)
    assert np.abs(found - expected).max() <= 1e-9


MIRRORED = [name for name in SHAPES if "," in name]


@pytest.mark.parametrize("name", MIRRORED)
def test_normal_map_is_the_same_in_target_quality(name: str) -> None:
    """One texel: all samples of a flat surface agree, and detail is shaded apart from light in float32."""
    shape, field, outward = SHAPES[name]
    tangent, _, normal = frame(field, outward, 0.45, 0.4)
    place = field(0.45, 0.4)
    document, _ = lit(shape, place + 2 * (normal + 0.1 * tangent), place)
    document["camera"] |= {"width": 4, "height": 4}
    target = TargetQuality(mode="target", error=1 / 255)
    plans = [plan_of(document, quality, files=FILES) for quality in (DOUBLE, target)]
    fixed, adaptive = (renderer.render(plan).image for plan in plans)
    assert np.abs(adaptive - fixed).max() <= 2.0**-18
