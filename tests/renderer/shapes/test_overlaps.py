"""Coplanar shapes and equal ellipsoids: the first in the scene is seen."""

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import pytest

import renderer
from schemas.quality import TargetQuality
from tests.documents import Json, camera, ellipsoid, lamp, mesh, phong, rectangle, scene, sphere, triangle
from tests.pictures.parts import image_of, plan_of, png
from tests.solids import triangles_of

UPWARD = np.array([0.3, 0.9, 0.2]) / np.linalg.norm([0.3, 0.9, 0.2])
ACROSS = np.cross(UPWARD, [0, 0, 1.0]) / np.linalg.norm(np.cross(UPWARD, [0, 0, 1.0]))
ALONG, MIDDLE = np.cross(UPWARD, ACROSS), np.array([3.1, -2.3, 1.7])
EYE = MIDDLE + 4 * UPWARD + ACROSS + 2.5 * ALONG
BLACK = {"black.png": png(np.zeros((2, 2, 3), dtype=np.uint8))}

Patch = tuple[tuple[float, float], tuple[float, float]]
FIRST: Patch = ((-1.0, 0.4), (-0.9, 1.0))
SECOND: Patch = ((-0.4, 1.0), (-1.0, 0.8))
"""Least and greatest place across and along in a plane that no double is exact in; they overlap in part."""


def overlaps(document: Json) -> bool:
    return "shapes in one place" in [entry.name for entry in plan_of(document).entries]


def tilted(u: Any, v: Any) -> Any:
    """Places (..., 3) in the plane."""
    return MIDDLE + np.multiply.outer(u, ACROSS) + np.multiply.outer(v, ALONG)


def cells(patch: Patch, size: int) -> tuple[Any, Any]:
    """Vertices and faces of a patch cut into 2 * size * size triangles."""
    u, v = np.meshgrid(*(np.linspace(*side, size + 1) for side in patch))
    corner = np.array([i * (size + 1) + j for i in range(size) for j in range(size)])
    lower = np.stack((corner, corner + 1, corner + size + 2), axis=1)
    upper = np.stack((corner, corner + size + 2, corner + size + 1), axis=1)
    return tilted(u.ravel(), v.ravel()), np.concatenate((lower, upper))


def board(patch: Patch, material: str) -> list[Json]:
    (left, right), (low, high) = patch
    edges = (right - left) * ACROSS, (high - low) * ALONG
    return [rectangle(tilted(left, low), *edges, material=material)]


def loose(size: int) -> Callable[[Patch, str], list[Json]]:
    """Single triangles."""

    def shapes(patch: Patch, material: str) -> list[Json]:
        vertices, faces = cells(patch, size)
        return [triangle(*vertices[face], material=material) for face in faces]

    return shapes


def netted(size: int) -> Callable[[Patch, str], list[Json]]:
    """One mesh."""
    return lambda patch, material: [mesh(*cells(patch, size), material=material)]


def relief(kind: Callable[[Patch, str], list[Json]]) -> Callable[[Patch, str], list[Json]]:
    """Displaced by a black map: where it was."""
    return lambda patch, material: kind(patch, f"{material} relief")


KINDS = {
    "rectangle": board,
    "few triangles": loose(1),
    "many triangles": loose(5),
    "small mesh": netted(3),
    "large mesh": netted(6),
    "small relief": relief(board),
    "large relief": relief(netted(5)),
}
"""On both sides of the 32 triangles from which on a tree is used; a relief is cut finer by the picture."""


def pair_of(first: str, second: str) -> tuple[Json, int]:
    """A red patch of one kind before a green one of another, and how many shapes the red one is."""
    red, green = KINDS[first](FIRST, "red"), KINDS[second](SECOND, "green")
    plain = {"red": phong([1, 0, 0], ambient=1), "green": phong([0, 1, 0], ambient=1)}
    moved = {"displacement_map": "black", "displacement_height": 0.3}
    pixels = 8 if "small relief" in (first, second) else 24
    document = scene(
        *red,
        *green,
        ambient=[1, 1, 1],
        materials=plain | {f"{name} relief": {**each, **moved} for name, each in plain.items()},
        camera=camera(position=EYE, look_at=MIDDLE, width=pixels, height=pixels),
        textures={"black": {"type": "image", "asset": "black.png", "encoding": "linear"}},
    )
    return document, len(red)


def shown(u: Any, v: Any) -> Any:
    """Patch seen at points of the plane: 0 for the first, 1 for the second, -1 for neither."""

    def within(patch: Patch) -> Any:
        (left, right), (low, high) = patch
        return (u > left) & (u < right) & (v > low) & (v < high)

    return np.where(within(FIRST), 0, np.where(within(SECOND), 1, -1))


def pixel_places(pixels: int) -> tuple[Any, Any]:
    """Places u and v (pixels, pixels, 100) that each pixel of a picture shows, rim included."""
    forward = (MIDDLE - EYE) / np.linalg.norm(MIDDLE - EYE)
    right = np.cross(forward, [0, 1.0, 0]) / np.linalg.norm(np.cross(forward, [0, 1.0, 0]))
    inside = np.linspace(0, 1, 10)
    steps = np.tan(np.radians(22)) * (2 * (np.arange(pixels)[:, None] + inside) / pixels - 1)
    y, x = np.broadcast_arrays(-steps[:, None, :, None], steps[None, :, None, :])
    ways = forward + np.multiply.outer(x, right) + np.multiply.outer(y, np.cross(right, forward))
    t = (MIDDLE - EYE) @ UPWARD / (ways @ UPWARD)
    relative = EYE + t[..., None] * ways - MIDDLE
    return tuple((relative @ axis).reshape(pixels, pixels, -1) for axis in (ACROSS, ALONG))


def assert_first_is_seen(first: str, second: str, qualities: Any) -> None:
    """By rays from both sides, and in pictures of these qualities."""
    document, count = pair_of(first, second)
    plan = plan_of(document, files=BLACK)
    random = np.random.default_rng(7)
    u, v = random.uniform(-1.1, 1.1, (2, 600))
    sides = 3 * UPWARD * np.where(np.arange(600) % 2, 1, -1)[:, None]
    origins = tilted(u, v) + sides + random.normal(size=(600, 3))
    hits = renderer.trace(plan, origins, tilted(u, v) - origins).shape
    np.testing.assert_array_equal(np.where(hits < 0, -1, hits >= count), shown(u, v))
    places = shown(*pixel_places(plan.width))
    alone = (places == places[..., :1]).all(axis=2)
    seen = places[alone][:, 0]
    assert {0, -1} <= set(seen.tolist())
    for quality in qualities:
        image = image_of(document, quality, files=BLACK)[alone]
        np.testing.assert_array_equal(np.argmax(image, axis=1), np.where(seen < 0, 2, seen))


FAST = [
    ("large mesh", "many triangles"),
    ("rectangle", "large mesh"),
    ("few triangles", "rectangle"),
    ("large relief", "small mesh"),
    ("rectangle", "large relief"),
    ("many triangles", "few triangles"),
]


@pytest.mark.parametrize(("first", "second"), FAST)
def test_coplanar_shapes_show_the_first(first: str, second: str) -> None:
    assert_first_is_seen(first, second, [None])


@pytest.mark.slow
@pytest.mark.parametrize(("first", "second"), [*product(KINDS, KINDS)])
def test_coplanar_shapes_of_all_kinds_show_the_first(first: str, second: str) -> None:
    assert_first_is_seen(first, second, [None, TargetQuality(error=0.05)])


def rug(size: int) -> Json:
    """A mesh of 2 * size * size triangles in the plane of `FLOOR`."""
    steps = np.linspace(-1, 1, size + 1)
    x, z = (part.ravel() for part in np.meshgrid(steps, steps))
    _, faces = cells(FIRST, size)
    return mesh(np.stack((x, np.full(x.size, 0.1), z), axis=1), faces, material="other")


FLOOR = rectangle([-2, 0.1, -2], [0, 0, 4], [4, 0, 0])
SIGN = triangle([-1, 0.1, -1], [-0.9, 0.1, 1.1], [1.3, 0.1, -0.7], material="other")


@pytest.mark.parametrize("later", [[SIGN], [rug(3)], [rug(6)], [SIGN, rug(6)]])
@pytest.mark.parametrize("floor", [FLOOR, {**rug(7), "scale": [2, 1, 2], "material": "plain"}])
def test_shape_inside_an_earlier_one_changes_no_pixel(floor: Json, later: list[Json]) -> None:
    """Neither where it is seen, nor in a mirror, nor by its shadow."""
    mirror = {"mirror": phong([0, 0, 0], ambient=0, diffuse=0, mirror=0.9)}
    wall = rectangle([-2, 0, -2], [4, 0, 0], [0, 3, 0], material="mirror")
    light = lamp([-1, 3, -1], [2, 0, 0], [0, 0, 2], visible=False)
    materials = {"plain": phong(), "other": phong([0.1, 0.9, 0.2], specular=0.4)} | mirror
    with_it, without = (
        scene(floor, *more, sphere([0.4, 0.6, 0.5], 0.4), wall, materials=materials, lights=[light])
        for more in (later, [])
    )
    assert overlaps(with_it)
    np.testing.assert_array_equal(image_of(with_it), image_of(without))


@pytest.mark.parametrize("sizes", [(6, 7, 8), (3, 7, 8), (6, 2, 8)])
def test_first_of_three_meshes_is_seen(sizes: tuple[int, ...]) -> None:
    """Whichever of them is hit, and whichever of the others is nearer then."""
    plan = plan_of(scene(*map(rug, sizes), materials={"other": phong()}))
    x, z = np.random.default_rng(9).uniform(-0.99, 0.99, (2, 600))
    ends = np.stack((x, np.full(600, 0.1), z), axis=1)
    origins = ends + np.random.default_rng(10).normal([0, 3, 0], 1, (600, 3))
    assert not renderer.trace(plan, origins, ends - origins).shape.any()


@pytest.mark.parametrize("behind", [("large mesh", "many triangles"), ("rectangle", "large mesh")])
def test_glass_shows_the_first_shape_in_its_plane(behind: tuple[str, str]) -> None:
    """Rays that leave it touch both others, at no distance but a rounding."""
    document, _ = pair_of(*behind)
    document["materials"] |= {"clear": phong([0, 0, 0], ambient=0, diffuse=0, transmission=1, ior=1)}
    document["shapes"] = [*netted(6)(((-1.1, 1.1), (-1.1, 1.1)), "clear"), *document["shapes"]]
    chosen = (shown(*pixel_places(24)) == 0).all(axis=2)
    assert chosen.sum() > 20
    assert (np.argmax(image_of(document, files=BLACK)[chosen], axis=1) == 0).all()


def test_shapes_that_touch_do_not_overlap() -> None:
    """Tiles, triangles and a wall turned by an angle that no double is exact at, and parallel planes."""
    across, up = np.array([np.cos(0.3), 0, np.sin(0.3)]), np.array([0.0, 1, 0])
    along, corner = np.cross(across, up), np.array([1e5, 3.0, -7e4])
    places = [(corner + i * across + j * along) for i in range(4) for j in range(4)]
    tiles = [rectangle(place, across, along) for place in places]
    vertices = np.array([place + 8 * across for place in places])
    starts = [4 * i + j for i in range(3) for j in range(3)]
    faces = np.array([(c, c + 4, c + 5) for c in starts] + [(c, c + 5, c + 1) for c in starts])
    assert not overlaps(scene(*tiles, *triangles_of(vertices, faces), rectangle(corner, across, up)))
    floors = [rectangle([-2, y, -2], [0, 0, 4], [4, 0, 0]) for y in (0.1, 0.1 + 1e-12)]
    assert not overlaps(scene(*floors))
    assert overlaps(scene(floors[0], triangle([-1, 0.1, -1], [-0.9, 0.1, 1.1], [1.3, 0.1, -0.7])))
    for change in ({"center": [0, 1e-12, 0]}, {"radius": 1 - 1e-12}):
        assert not overlaps(scene(sphere([0, 0, 0], 1), {**sphere([0, 0, 0], 1), **change}))


@pytest.mark.parametrize("order", [1, -1])
def test_ellipsoids_that_are_equal_show_the_first(order: int) -> None:
    """By radius and by axes, and by axes that are the same but for a turn in the plane of two equal ones."""
    random, center = np.random.default_rng(8), np.array([70.3, -31.7, 9.1])
    turned = np.linalg.qr(random.normal(size=(3, 3)))[0]
    across, along, thin = turned * np.array([[1.5], [1.5], [1e-3]])
    disc = np.cos(0.7) * across + np.sin(0.7) * along, np.cos(0.7) * along - np.sin(0.7) * across
    pairs = [
        (sphere(center, 1.5), sphere(center, 1.5)),
        (sphere(center, 1.5), ellipsoid(center, *(1.5 * turned))),
        (ellipsoid(center, across, along, thin), ellipsoid(center, *disc, -thin)),
    ]
    ways = random.normal(size=(400, 3))
    targets = center + random.uniform(-0.6, 0.6, (400, 2)) @ np.stack((across, along))
    for pair in pairs:
        assert not renderer.trace(plan_of(scene(*pair[::order])), targets - 9 * ways, ways).shape.any()


def test_rug_above_a_huge_floor_is_seen() -> None:
    """Corners at 1e13 round places by 1e-3, but a floor along two axes has its height from one number."""
    floor = rectangle([-1e13, 0, -1e13], [0, 0, 2e13], [2e13, 0, 0])
    x, z = np.random.default_rng(1).uniform(-1.5, 1.5, (2, 400))
    origins = np.stack((x, np.full(400, 0.15), z), axis=1)
    for height in (0.05, 1e-6):
        plan = plan_of(scene(floor, rectangle([-2, height, -2], [0, 0, 4], [4, 0, 0])))
        assert (renderer.trace(plan, origins, np.tile([0.0, -1, 0], (400, 1))).shape == 1).all()


@pytest.mark.parametrize("place", [0, 7, 20])
def test_mesh_that_comes_first_of_many_copies_is_seen(place: int) -> None:
    """20 copies, and a square over half of them that is earlier than all, than some or than none."""
    shapes = netted(5)(((-1.0, 1.0), (-1.0, 1.0)), "plain") * 20
    shapes.insert(place, *board(((0.0, 1.0), (-1.0, 1.0)), "plain"))
    u, v = np.random.default_rng(3).uniform(-0.99, 0.99, (2, 500))
    ways = np.tile(0.2 * ACROSS - UPWARD, (500, 1))
    hits = renderer.trace(plan_of(scene(*shapes)), tilted(u, v) - ways, ways)
    assert hits.shape.tolist() == np.where((place == 0) & (u < 0), 1, 0).tolist()
