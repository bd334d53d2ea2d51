"""One picture by each of the ways that the renderer may take to it.

Which way it takes follows from a size, a count, a kind or what was kept: few triangles or many, a pinhole or
a lens, one light point or many, a light with an extent or without. Each test draws the same thing on both
sides of such a choice, and knows nothing of where that lies. Other tests that do so: `test_literal_pairs`
(every kind in the way of every kind), `test_invariance` (culling, tiles), `tests/renderer/accelerators`.
"""

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from schemas.quality import TargetQuality
from tests.documents import (
    Json,
    bulb,
    camera,
    ellipsoid,
    lamp,
    mesh,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    sun,
    triangle,
)
from tests.pictures import pictures
from tests.pictures.paired_scenes import cut
from tests.pictures.parts import DOUBLE, SINGLE, image_of, plan_of, png, same, samples_of
from tests.solids import outward

FLOOR = rectangle([-3, 0, -3], [0, 0, 6], [6, 0, 0])
FOLD = (
    [
        [-1.2, 0.1, -1.3],
        [1.4, 0.2, -1.1],
        [1.2, 0.3, 1.2],
        [-1.1, 0.15, 1],
        [-0.9, 1.9, -1],
        [1.2, 2.2, -0.6],
    ],
    [[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 5, 4]],
)
"""A book half open, its inner sides towards the camera: one leaf lies over the floor, the other stands."""
LAMP = lamp([0.4, 3.7, 1.1], [1.1, 0.1, 0], [0, 0.3, 0.9])
SUN, BULB = sun([-0.5, -0.8, -0.9]), bulb([-0.3, 2.6, 1.4])
SHINY = phong([0.4, 0.5, 0.6], specular=0.5, shininess=20)
MATERIALS = {"plain": phong(), "shiny": SHINY}
ROUNDING = 1e-9
"""Of samples in double precision. None of these scenes has a pair so near to a border that it decides."""

FILES = {
    "picture.png": png(pictures.codes(6, 5)),
    "bumps.png": png(pictures.bumps()),
    "black.png": png(np.zeros((1, 1, 3), np.uint8)),
}


def folded(*shapes: Json, **changes: Any) -> Json:
    usual = {"lights": [LAMP, SUN, BULB], "materials": MATERIALS, "sampling": sampled(1, 9)}
    return scene(*shapes, **{**usual, **changes})


def samples(document: Json, files: Any = FILES) -> NDArray[np.float64]:
    return samples_of(plan_of(document, DOUBLE, files=files))


def assert_alike(document: Json, other: Json, bound: float = ROUNDING, files: Any = FILES) -> None:
    """Both have the same samples, of which many differ from each other."""
    found, expected = samples(document, files), samples(other, files)
    assert np.abs(found - expected).max() <= bound
    assert len(np.unique(expected.reshape(-1, 3).round(4), axis=0)) >= 10


def singles(vertices: Any, triangles: Any, **changes: Any) -> list[Json]:
    return [triangle(*(list(map(float, vertices[i])) for i in row), **changes) for row in triangles]


def ply(vertices: Any, triangles: Any) -> bytes:
    head = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        f"element face {len(triangles)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    faces = np.zeros(len(triangles), dtype=[("count", "u1"), ("rows", "<i4", 3)])
    faces["count"], faces["rows"] = 3, triangles
    return "\n".join([*head, ""]).encode() + np.asarray(vertices, "<f8").tobytes() + faces.tobytes()


# What stands far from all rays: below the floor and behind the camera.
AWAY = np.array([3.0, -300.0, 400.0])
SPLINTER = np.add(AWAY, [[0, 0, 0], [0.01, 0.002, 0], [0, 0.01, 0.003]])
NET = cut(SPLINTER, [[0, 1, 2]], 7)
RELIEF: Json = {"type": "image", "asset": "bumps.png", "encoding": "linear"}


def _of(**material: Any) -> Json:
    """A change of a scene: one small triangle of a material that no other shape has."""
    return {"shapes": [triangle(*SPLINTER, material="far")], "materials": {"far": phong(**material)}}


FAR: dict[str, Json] = {
    "a triangle": {"shapes": [triangle(*SPLINTER)]},
    "a ball": {"shapes": [sphere(AWAY, 0.01)]},
    "a mesh of 49 triangles": {"shapes": [mesh(*NET)]},
    "49 triangles": {"shapes": singles(*NET)},
    "a smooth triangle": {"shapes": [triangle(*SPLINTER, normals=[[1, 1, 5], [0, 1, 4], [1, 0, 3]])]},
    "a mirror": _of(mirror=0.5),
    "glass": _of(transmission=0.9, ior=1.5),
    "a sharp highlight": _of(specular=0.4, shininess=900),
    "a normal map": _of(normal_map="relief"),
    "a bump map": _of(bump_map="relief", bump_height=0.2),
    "49 triangles that heights move": {
        **_of(displacement_map="relief", displacement_height=0.002),
        "shapes": [mesh(*NET, material="far")],
    },
    "a texture that filters": _of(color_texture="filtered"),
    "a board that filters": _of(color_texture="board"),
    "a lamp that is seen": {
        "lights": [lamp(AWAY, [0.01, 0, 0], [0, 0.01, 0], color=[0, 0, 0], visible=True)]
    },
}
ROUGH: Json = {"type": "image", "asset": "picture.png", "encoding": "linear"}
TEXTURES = {
    "relief": RELIEF,
    "rough": ROUGH,
    "filtered": {"type": "image", "asset": "picture.png", "filter": "mipmap"},
    "board": {"type": "checker", "filter": "box"},
}
INSIDE = camera(position=[0.1, 0.9, 0.2], look_at=[0.6, 0.7, -1], vertical_fov=80)
NEAR: dict[str, Json] = {
    "a fold alone": folded(mesh(*FOLD), lights=[LAMP, sun([0.3, -0.8, 0.9]), BULB]),
    "a fold of single triangles": folded(
        *singles(*FOLD), lights=[LAMP], sampling=sampled(1, 9, light="sobol")
    ),
    "an ellipsoid from inside": folded(
        ellipsoid([0, 1, 0], [2, 0, 0.3], [0, 1.5, 0], [-0.3, 0, 2]),
        lights=[bulb([-0.4, 1.3, 0.5]), lamp([0.2, 1.9, -0.3], [0.5, 0.2, 0], [0, 0.9, 0.6])],
        camera=INSIDE,
    ),
    "a small relief": folded(
        rectangle([-1.6, 0.3, -1.6], [0, 0, 3.2], [3.2, 0, 0], material="relief"),
        materials=MATERIALS | {"relief": phong(displacement_map="rough", displacement_height=1.5)},
        textures={"rough": ROUGH},
        lights=[sun([-1, -0.3, -0.5]), lamp([2.4, 1.2, -0.4], [0, 0.8, 0], [0, 0, 0.9])],
        camera=camera(width=9, height=6),
        sampling=sampled(25, 9),
    ),
    "every kind": folded(
        FLOOR,
        mesh(*FOLD, material="shiny"),
        sphere([0.6, 0.9, 0.9], 0.4),
        rectangle([-1.4, 1.1, 0.7], [0.9, 0, 0.2], [0.1, 0.8, 0], material="shiny"),
        *singles(*FOLD)[:1],
        lights=[LAMP, SUN],
    ),
}


def with_far(document: Json, far: Json) -> Json:
    more = {part: [*document[part], *far.get(part, [])] for part in ("shapes", "lights")}
    materials = {**document["materials"], **far.get("materials", {})}
    return {**document, **more, "materials": materials, "textures": TEXTURES}


@pytest.mark.parametrize("far", FAR)
@pytest.mark.parametrize("near", NEAR)
def test_far_shapes_change_nothing(near: str, far: str) -> None:
    """Distant shapes may cause a tree, a stage or another algorithm, but are hit by no ray."""
    assert_alike(with_far(NEAR[near], FAR[far]), NEAR[near])


@pytest.mark.slow
def test_many_triangles_change_nothing() -> None:
    """72,900 of them are more than are projected on the screen at once."""
    files = {"far.ply": ply(*cut(SPLINTER, [[0, 1, 2]], 270))}
    far = {"shapes": [{"type": "mesh", "asset": "far.ply", "material": "plain"}]}
    assert_alike(with_far(NEAR["every kind"], far), NEAR["every kind"], files=files)


def forms(vertices: Any, triangles: Any) -> dict[str, list[Json]]:
    """One surface in all ways to write it."""
    half = len(triangles) // 2
    kept = mesh(vertices, triangles, material="kept")
    return {
        "single triangles": singles(vertices, triangles),
        "two meshes": [mesh(vertices, triangles[:half]), mesh(vertices, triangles[half:])],
        "a mesh and single triangles": [
            mesh(vertices, triangles[:half]),
            *singles(vertices, triangles[half:]),
        ],
        "a file": [{"type": "mesh", "asset": "surface.ply", "material": "plain"}],
        "a mesh that a black map moves": [kept],
        "cut in 3": [mesh(*cut(vertices, triangles, 3))],
        "cut in 25": [{"type": "mesh", "asset": "fine.ply", "material": "plain"}],
    }


BALL = outward([0.3, 1.0, 0.1], 0.9, 0)
SURFACES = {"an open fold": FOLD, "a closed ball": (BALL[0].tolist(), BALL[1].tolist())}
KEPT = {"kept": phong(displacement_map="black", displacement_height=0.5)}
BLACK = {"black": {"type": "image", "asset": "black.png", "encoding": "linear"}}


@pytest.mark.parametrize("view", ["from outside", "from inside"])
@pytest.mark.parametrize("pattern", ["uniform", "sobol"])
@pytest.mark.parametrize("name", SURFACES)
def test_surface_in_every_form(name: str, pattern: str, view: str) -> None:
    """A few triangles one by one, many on the screen, through trees by pairs or rays, or past solid boxes."""
    vertices, triangles = SURFACES[name]
    files = FILES | {"surface.ply": ply(vertices, triangles), "fine.ply": ply(*cut(vertices, triangles, 25))}
    near = camera(position=[0.35, 1.05, 0.3], look_at=[0.2, 0.7, -1], vertical_fov=95)
    more = {"textures": BLACK, "materials": MATERIALS | KEPT, "sampling": sampled(1, 9, light=pattern)}
    more |= {"camera": near} if view == "from inside" else {}
    expected = samples(folded(FLOOR, mesh(vertices, triangles), **more))
    for form, shapes in forms(vertices, triangles).items():
        found = samples(folded(FLOOR, *shapes, **more), files)
        assert np.abs(found - expected).max() <= ROUNDING, form


@pytest.mark.slow
@pytest.mark.parametrize("target", [4 / 255, 1 / 255])
def test_target_of_a_surface_in_every_form(target: float) -> None:
    """Many samples of one form are the truth for all. One form brings other pilot samples than another."""
    more = {"textures": BLACK, "materials": MATERIALS | KEPT, "lights": [LAMP, SUN]}
    true = image_of(folded(FLOOR, mesh(*FOLD), **more, sampling=sampled(256, 4, "sobol", "sobol")), DOUBLE)
    files = FILES | {"surface.ply": ply(*FOLD), "fine.ply": ply(*cut(*FOLD, 25))}
    aim = TargetQuality(mode="target", error=target)
    for form, shapes in forms(*FOLD).items():
        found = image_of(folded(FLOOR, *shapes, **more), aim, files=files)
        errors = np.clip(found, 0, 1) - np.clip(true, 0, 1)
        assert np.sqrt((errors**2).mean()) <= target, form


def rays_at(document: Json, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """From places around a scene's shapes towards places among them."""
    rng = np.random.default_rng(len(document["shapes"]))
    origins = rng.normal(size=(count, 3)) * [1, 0.5, 1] * 2 + [0, 2.5, 2]
    return origins, rng.uniform([-1.5, 0, -1.5], [1.5, 1.5, 1.5], (count, 3)) - origins


def parts_of(hits: renderer.Hits, chosen: Any) -> Iterator[tuple[str, Any]]:
    names = ("t", "position", "normal", "uv", "shape", "primitive", "visibility")
    return ((name, getattr(hits, name)[chosen]) for name in names)


@pytest.mark.parametrize("far", ["a ball", "a mesh of 49 triangles"])
def test_rays_together_and_alone(far: str) -> None:
    """Together they are more than any block, or portion of one, that the renderer works on at once."""
    document = with_far(NEAR["every kind"], FAR[far])
    plan = plan_of(document)
    origins, ways = rays_at(document, 20_000)
    whole = renderer.trace(plan, origins, ways)
    for begin, end in itertools.pairwise([0, 1, 2, 9, 1000, 6000, 20_000]):
        part = renderer.trace(plan, origins[begin:end], ways[begin:end])
        for (name, some), (_, other) in zip(
            parts_of(part, ...), parts_of(whole, slice(begin, end)), strict=True
        ):
            np.testing.assert_array_equal(some, other, err_msg=name)


@pytest.mark.parametrize("far", ["a ball", "a mesh of 49 triangles", "49 triangles"])
def test_rays_from_far_away(far: str) -> None:
    """Ellipsoids take other formulas for rays that begin far from them."""
    document = with_far(NEAR["every kind"], FAR[far])
    plan = plan_of(document, DOUBLE)
    origins, ways = rays_at(document, 3000)
    near = renderer.trace(plan, origins, ways)
    # Where nothing stands behind the origin, the ray may as well begin there.
    free = np.isinf(renderer.trace(plan, origins, -ways).t) & np.isfinite(near.t)
    farther = renderer.trace(plan, (origins - 50 * ways)[free], ways[free])
    assert free.sum() > 500
    np.testing.assert_array_equal(farther.shape, near.shape[free])
    np.testing.assert_array_equal(farther.primitive, near.primitive[free])
    np.testing.assert_allclose(farther.position, near.position[free], atol=1e-11)
    np.testing.assert_array_equal(farther.visibility, near.visibility[free])


@pytest.mark.parametrize("near", NEAR)
@pytest.mark.parametrize("far", ["a ball", "a mesh of 49 triangles", "49 triangles"])
def test_tiny_lens_is_a_pinhole(near: str, far: str) -> None:
    """Rays of a pinhole share their origin, and find many triangles on the screen."""
    document = with_far(NEAR[near], FAR[far])
    lens = {**document["camera"], "lens_radius": 1e-13}
    assert_alike({**document, "camera": lens}, document)


@pytest.mark.parametrize("falloff", ["none", "physical"])
@pytest.mark.parametrize("far", ["a ball", "a mesh of 49 triangles", "49 triangles"])
def test_hardly_skew_lamp(far: str, falloff: str) -> None:
    """Light points of rectangles are sums of a row and a column; those of parallelograms stand alone."""
    square, skew = (
        lamp([0.4, 3.7, 1.1], [1.1, 0, 0], [slip, 0.3, 0.9], falloff=falloff) for slip in (0.0, 1e-12)
    )
    shapes = NEAR["every kind"]["shapes"]
    documents = [with_far(folded(*shapes, lights=[light]), FAR[far]) for light in (square, skew)]
    assert_alike(*documents)


@pytest.mark.parametrize("far", ["a ball", "a mesh of 49 triangles", "49 triangles"])
@pytest.mark.parametrize("pattern", ["uniform", "stratified", "sobol"])
def test_small_lamp_and_far_bulb(pattern: str, far: str) -> None:
    """A light with an extent has shafts and pyramids; one at infinity has neither ends nor a distance."""
    shapes, middle = NEAR["every kind"]["shapes"], np.array([0.5, 3.3, 1.2])
    sampling = sampled(1, 9, light=pattern)
    small = lamp(middle - 5e-11, [1e-10, 0, 0], [0, 0, 1e-10], color=[0.5, 0.6, 0.7])
    distant = bulb(middle * 1e9, color=[0.5, 0.6, 0.7])
    for light, other in ((small, bulb(middle)), (distant, sun(-middle, color=[0.5, 0.6, 0.7]))):
        some, others = (
            with_far(folded(*shapes, lights=[x], sampling=sampling), FAR[far]) for x in (light, other)
        )
        assert_alike(some, others, bound=1e-7)


def test_very_many_light_points() -> None:
    """4,096 points of a lamp for each of 108 pixels are more than are worked on at once."""
    shapes = NEAR["every kind"]["shapes"]
    view = camera(width=12, height=9)
    for far, pattern in (("a ball", "uniform"), ("49 triangles", "random")):
        sampling = sampled(1, 4096, light=pattern)
        document = with_far(folded(*shapes, lights=[LAMP], camera=view, sampling=sampling), FAR[far])
        plan = plan_of(document)
        assert same(renderer.render(plan, tile_size=1).image, renderer.render(plan).image)


def test_very_many_camera_samples() -> None:
    """The last pass takes 3,072 samples of each of 16 pixels: more rays than find triangles at once."""
    view = camera(width=4, height=4)
    document = with_far(folded(FLOOR, mesh(*FOLD), lights=[SUN], camera=view), FAR["a mesh of 49 triangles"])
    plan = plan_of({**document, "sampling": sampled(4096, 1, "sobol")})
    assert same(renderer.render(plan, tile_size=1).image, renderer.render(plan).image)


@pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])
def test_highlights_on_both_sides_of_a_power(quality: Any) -> None:
    """Exponents up to 128 may be powers of float32: a dozen roundings of a cosine, times the exponent."""
    images = []
    for shininess in (128.0, 128.0001):
        shiny = {"plain": phong(specular=0.9, shininess=shininess)}
        document = folded(sphere([0, 1.4, 0], 1.2), lights=[LAMP, BULB], materials=shiny)
        images.append(image_of(document, quality))
    assert 0 < np.abs(images[0] - images[1]).max() <= 12 * 128 * 2.0**-24
    assert images[0].max() > 1


def test_cached_meshes_change_no_byte() -> None:
    """The same vertices smooth and flat, in other shapes, and others until nothing is kept of the first."""
    ball = outward([0.3, 1.0, 0.1], 0.9, 1)
    flat, smooth = (folded(FLOOR, mesh(*ball, smooth=smooth)) for smooth in (False, True))
    two = folded(FLOOR, *(mesh(ball[0], part) for part in (ball[1][:40], ball[1][40:])))
    documents = [flat, smooth, two]
    first = [image_of(document) for document in documents]
    for size in (0.5, 0.6, 0.7, 0.8, 0.85):
        image_of(folded(FLOOR, mesh(ball[0] * size, ball[1])))
    for document, image in zip(reversed(documents), reversed(first), strict=True):
        assert same(image_of(document), image)
    assert same(first[0], first[2])
    assert not same(first[0], first[1])


def test_texture_of_two_uses() -> None:
    """As colours a picture is decoded, as normals it is not."""
    picture = {"type": "image", "asset": "picture.png", "encoding": "srgb"}
    both, apart = (
        folded(
            FLOOR,
            sphere([0, 1, 0], 0.9),
            textures={"colors": picture, other: picture},
            materials={"plain": phong(color_texture="colors", normal_map=other)},
        )
        for other in ("colors", "normals")
    )
    assert same(image_of(both, files=FILES), image_of(apart, files=FILES))


def board(repeats: Sequence[int], asset: str) -> Json:
    """A texture that is seen from near to far, so that every version of it is looked up."""
    texture = {"type": "image", "asset": asset, "filter": "mipmap", "wrap": "repeat"}
    uvs = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * repeats
    floor = mesh([[-3, 0, -40], [3, 0, -40], [3, 0, 5], [-3, 0, 5]], [[0, 2, 1], [0, 3, 2]], uvs=uvs.tolist())
    return folded(floor, textures={"tile": texture}, materials={"plain": phong(color_texture="tile")})


def test_large_texture_repeats_a_small_one() -> None:
    """Decoded, made linear and halved in bands if it has many texels: each is rounded to float32."""
    rng = np.random.default_rng(5)
    small = rng.integers(0, 256, (16, 16, 3), dtype=np.uint8)
    files = {"small.png": png(small), "large.png": png(np.tile(small, (65, 64, 1)))}
    assert_alike(board((1, 1), "large.png"), board((64, 65), "small.png"), bound=2.0**-20, files=files)
