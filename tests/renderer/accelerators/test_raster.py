"""Rasterisation and the tree find bitwise equal hits of camera rays."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import schemas.cameras as language
from renderer.accelerators.intersection import TreeIntersector
from renderer.accelerators.raster import Raster, RasterIntersector
from renderer.accelerators.trees import MAX_UNTREED_TRIANGLES, tree_of
from renderer.cameras import Pinhole, build_pinhole
from renderer.interaction import Rays
from renderer.shapes.triangles import Triangles, build
from schemas.shapes import Triangle
from tests import solids
from tests.documents import lamp, scene
from tests.pictures.parts import Files, plan_of

Floats = np.ndarray
WIDTH, HEIGHT = 48, 32
FAR = [148376.0, 1234.0, -223423.0]
EVERYWHERE = pytest.mark.parametrize("place", [[0.0, 0.0, 0.0], FAR], ids=["at the origin", "far away"])
"""Position of the camera, which looks along z."""


def camera(place: Any, fov: float = 50.0) -> Pinhole:
    target = np.add(place, [0, 0, 1]).tolist()
    return build_pinhole(
        language.Camera(position=place, look_at=target, vertical_fov=fov, width=WIDTH, height=HEIGHT)
    )


def family(corners: Floats) -> Triangles:
    """From triangles (K, 3, 3): triangle, vertex, coordinate."""
    shapes = [Triangle(type="triangle", vertices=rows, material="plain") for rows in corners.tolist()]
    return build(list(range(len(shapes))), shapes, Files())


def rays_of(view: Pinhole, x: Floats, y: Floats) -> Rays:
    numbers = np.arange(x.size)
    left, right = view.screen(np.array([0, WIDTH]), np.array([HEIGHT, 0]))
    return Rays(
        view.position,
        view.directions(x, y),
        numbers,
        np.zeros_like(numbers),
        screen=np.concatenate((left, right)),
    )


def both_ways(corners: Floats, view: Pinhole, x: Floats, y: Floats) -> Rays:
    """The hits of rays through raster places, after it was seen that both ways agree in every bit."""
    shapes = family(corners)
    found, true = rays_of(view, x, y), rays_of(view, x, y)
    tree = TreeIntersector(shapes, tree_of(shapes))
    RasterIntersector(tree, view).run(found)
    tree.run(true)
    for name in ("t", "shapes", "primitives", "coordinates"):
        np.testing.assert_array_equal(getattr(found, name), getattr(true, name))
    return found


def anywhere(rng: np.random.Generator, count: int = 4000) -> tuple[Floats, Floats]:
    """Raster places: random ones, and corners, edges and middles of pixels."""
    x, y = rng.uniform(0, WIDTH, count), rng.uniform(0, HEIGHT, count)
    x[::2], y[::3] = np.round(2 * x[::2]) / 2, np.round(2 * y[::3]) / 2
    return x, y


def places_of(view: Pinhole, seen: Floats) -> tuple[Floats, Floats]:
    """Raster places of what lies at `seen` (N, 3) from the camera, at the border of the picture if beyond."""
    x = (1 - seen[:, 0] / seen[:, 2] / view.half_width) * WIDTH / 2
    y = (1 - seen[:, 1] / seen[:, 2] / view.half_height) * HEIGHT / 2
    return np.clip(x, 0, WIDTH), np.clip(y, 0, HEIGHT)


def soup(rng: np.random.Generator, count: int, size: float, depth: tuple[float, float]) -> Floats:
    middles = np.stack([rng.uniform(-3, 3, count), rng.uniform(-2, 2, count), rng.uniform(*depth, count)], -1)
    return middles[:, None] + rng.normal(size=(count, 3, 3)) * size


@EVERYWHERE
@pytest.mark.parametrize("size", [1e-9, 1e-3, 0.05, 0.5, 5.0], ids=lambda size: f"size {size}")
@pytest.mark.parametrize(
    "depth", [(2.0, 6.0), (-3.0, 3.0), (-6.0, -2.0)], ids=["ahead", "across the camera", "behind"]
)
def test_triangles_of_all_sizes(place: list[float], size: float, depth: tuple[float, float]) -> None:
    rng = np.random.default_rng(1)
    corners = soup(rng, 600, size, depth) + place
    view = camera(place)
    x, y = anywhere(rng)
    found = both_ways(corners, view, x, y)
    if depth[0] > 0 and size >= 0.05:
        assert np.isfinite(found.t).any()
    if depth[1] < 0 and size <= 0.05:
        assert np.isinf(found.t).all()


def test_triangles_around_the_camera_are_hit() -> None:
    """Some reach behind it, and those alone need another way than the screen."""
    rng = np.random.default_rng(2)
    corners = soup(rng, 600, 1.0, (-2.0, 2.0))
    shapes, view = family(corners), camera([0.0, 0.0, 0.0])
    raster = Raster.of(shapes, view)
    assert raster.ahead.numbers.size > MAX_UNTREED_TRIANGLES
    assert raster.ahead.others.size > MAX_UNTREED_TRIANGLES
    assert not set(raster.ahead.numbers) & set(raster.ahead.others)
    assert np.isfinite(both_ways(corners, view, *anywhere(rng)).t).all()


@EVERYWHERE
def test_rays_through_shared_edges_and_vertices(place: list[float]) -> None:
    """Places of vertices and of points between two of them, up to rounding."""
    rng = np.random.default_rng(3)
    vertices, faces = solids.icosphere([0.0, 0.0, 4.0], 1.4, 3)
    corners = np.asarray(vertices)[np.asarray(faces)]
    a, b = corners[:, 0], corners[:, 1]
    places = (
        np.concatenate((a, b, (a + b) / 2, a + (b - a) / 4)) + rng.integers(-3, 4, (4 * len(a), 3)) * 2.0**-52
    )
    view = camera(place)
    found = both_ways(corners + place, view, *places_of(view, places))
    assert np.isfinite(found.t).mean() > 0.95


def test_slivers_and_triangles_seen_edge_on() -> None:
    rng = np.random.default_rng(4)
    ends = rng.uniform([-2, -2, 2], [2, 2, 6], (400, 2, 3))
    thin = 10.0 ** rng.uniform(-17, -1, (400, 1))
    slivers = np.stack((ends[:, 0], ends[:, 1], ends[:, 0] + thin * rng.normal(size=(400, 3))), axis=1)
    along = rng.uniform(0.5, 1.5, (400, 1))
    edge_on = np.stack((ends[:, 0], ends[:, 1], ends[:, 0] * along), axis=1)
    view = camera([0.0, 0.0, 0.0])
    corners = np.concatenate((slivers, edge_on))
    x, y = places_of(view, corners.mean(axis=1))
    both_ways(corners, view, np.concatenate((x, x)), np.concatenate((y, np.nextafter(y, 0))))
    both_ways(corners, view, *anywhere(rng))


def test_of_equal_hits_the_first_triangle_counts() -> None:
    rng = np.random.default_rng(5)
    corners = soup(rng, 90, 0.8, (2.0, 4.0))
    found = both_ways(np.concatenate((corners, corners[::-1], corners)), camera([0.0] * 3), *anywhere(rng))
    assert found.shapes.max() in range(90)


def test_what_was_hit_before_stays_in_front() -> None:
    rng = np.random.default_rng(6)
    corners, view = soup(rng, 300, 0.5, (2.0, 6.0)), camera([0.0] * 3)
    shapes = family(corners)
    x, y = anywhere(rng)
    found, true = rays_of(view, x, y), rays_of(view, x, y)
    for rays in (found, true):
        rays.t[:] = np.where(np.arange(x.size) % 2, 3.5, np.inf)
        rays.shapes[:] = np.where(np.arange(x.size) % 2, 1000, -1)
    tree = TreeIntersector(shapes, tree_of(shapes))
    RasterIntersector(tree, view).run(found)
    tree.run(true)
    np.testing.assert_array_equal(found.shapes, true.shapes)
    assert {-1, 1000} < set(found.shapes.tolist())


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32),
    fov=st.sampled_from([1e-3, 1.0, 50.0, 120.0, 170.0]),
    scale=st.sampled_from([2.0**-60, 1.0, 2.0**30]),
    spread=st.sampled_from([2.0**-30, 2.0**-8, 1.0, 8.0]),
    place=st.sampled_from([[0.0, 0.0, 0.0], [3.0, -7.0, 11.0], FAR]),
)
def test_random_scenes(seed: int, fov: float, scale: float, spread: float, place: list[float]) -> None:
    """Triangles in the view, in all sizes, and some across the camera's plane; some vertices are shared."""
    rng = np.random.default_rng(seed)
    view = camera(np.multiply(place, scale).tolist(), fov)
    x, y = anywhere(rng, 500)
    chosen = rng.integers(0, x.size, 240)
    depth = rng.uniform(0.05, 6, (240, 1))
    middles = view.directions(x, y).T[chosen] * depth
    sizes = spread * 10.0 ** rng.uniform(-3, 0, (240, 1, 1)) * view.half_height * depth[..., None]
    corners = middles[:, None] + rng.normal(size=(240, 3, 3)) * sizes
    corners[1::3, 0], corners[2::3, 1] = corners[::3, 1], corners[::3, 1]
    corners[::11, 0] -= [0, 0, 8]
    both_ways((corners + place) * scale, view, x, y)


def ball(radius: float = 1.0) -> dict[str, Any]:
    vertices, faces = solids.icosphere([0.0, 0.0, 0.0], radius, 2)
    return {
        "type": "mesh",
        "vertices": np.asarray(vertices).tolist(),
        "triangles": np.asarray(faces).tolist(),
        "material": "plain",
    }


@pytest.mark.parametrize("lens", [0.0, 0.1])
def test_only_a_pinhole_rasterises(lens: float) -> None:
    document = scene(ball(), lights=[lamp([-1, 5, -1], [2, 0, 0], [0, 0, 2])])
    document["camera"]["lens_radius"] = lens
    plan = plan_of(document)
    (stage,) = plan.intersectors
    assert isinstance(stage, TreeIntersector if lens else RasterIntersector)
    (line,) = [line for line in plan.describe().stages if line.name == "hits of meshes"]
    assert ("rasterisation" in line.detail) is not bool(lens)
    assert line.pointers == ("/shapes/0",)


def test_rays_from_elsewhere_go_through_the_tree() -> None:
    corners = soup(np.random.default_rng(7), 300, 0.5, (2.0, 6.0))
    shapes = family(corners)
    tree = TreeIntersector(shapes, tree_of(shapes))
    seen = rays_of(camera([0.0] * 3), *anywhere(np.random.default_rng(8), 200))
    found, true = (Rays(seen.origins, seen.directions, seen.pixels, seen.samples) for _ in range(2))
    # A camera that sees nothing of them.
    RasterIntersector(tree, camera([0.0, 0.0, 100.0])).run(found)
    tree.run(true)
    assert np.isfinite(true.t).any()
    np.testing.assert_array_equal(found.t, true.t)
