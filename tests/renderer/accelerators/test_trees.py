"""Trees find bitwise the hits of testing every triangle; the cache of trees is thread-safe."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from renderer.accelerators import bvh
from renderer.accelerators.intersection import TreeIntersector
from renderer.accelerators.shafts import Shafts, visits_of_shafts
from renderer.accelerators.trees import tree_of
from renderer.integrator import intersect
from renderer.interaction import Rays
from renderer.plan.building import compile_visibility
from renderer.shapes.family import Intersector
from renderer.shapes.triangles import Triangles, build
from renderer.visibility.polygon_scatter import ScatterPolygonShadows
from renderer.visibility.trees import FEW_NODES, SHAFT_LEVELS, TreeShadows
from renderer.workspace import Workspace
from schemas.shapes import Triangle
from tests import solids
from tests.documents import Json, bulb, lamp, mesh, sampled, scene, sun, triangle
from tests.numerics.tracing import towards, traced
from tests.pictures.parts import DOUBLE, Files, plan_of

Floats = np.ndarray
FAR = [148376.0, 1234.0, -223423.0]
PLACES = [[0.0, 0.0, 0.0], FAR]
EVERYWHERE = pytest.mark.parametrize("place", PLACES, ids=["at the origin", "far away"])


def family(corners: Floats) -> Triangles:
    """From triangles (K, 3, 3): triangle, vertex, coordinate."""
    shapes = [Triangle(type="triangle", vertices=rows, material="plain") for rows in corners.tolist()]
    return build(list(range(len(shapes))), shapes, Files())


def hits_of(corners: Floats, origins: Floats, directions: Floats, *, tree: bool) -> Rays:
    shapes = family(corners)
    numbers = np.arange(len(origins))
    rays = Rays(np.array(origins).T.copy(), np.array(directions).T.copy(), numbers, np.zeros_like(numbers))
    (TreeIntersector(shapes, tree_of(shapes)) if tree else Intersector(shapes, None)).run(rays)
    return rays


def both_ways(corners: Floats, origins: Floats, directions: Floats) -> Rays:
    """The rays' hits, after it was seen that both ways agree in every bit."""
    found, true = (hits_of(corners, origins, directions, tree=tree) for tree in (True, False))
    for name in ("t", "shapes", "primitives", "coordinates"):
        np.testing.assert_array_equal(getattr(found, name), getattr(true, name))
    return found


def soup(rng: np.random.Generator, count: int, size: float, place: Any = (0, 0, 0)) -> Floats:
    return rng.uniform(-2, 2, (count, 1, 3)) + rng.normal(size=(count, 3, 3)) * size + place


@EVERYWHERE
@pytest.mark.parametrize("count", [1, 3, 4, 5, 33, 700])
def test_tree_finds_what_every_triangle_does(place: list[float], count: int) -> None:
    rng = np.random.default_rng(count)
    corners = soup(rng, count, 0.4, place)
    origins = place + rng.normal(size=(3000, 3)) * 3
    directions = corners[rng.integers(0, count, 3000)].mean(axis=1) - origins
    directions[::2] = rng.normal(size=(1500, 3))
    found = both_ways(corners, origins, directions * 10.0 ** rng.integers(-9, 9, (3000, 1)))
    assert np.isfinite(found.t).any()


def lattice(size: int) -> Floats:
    """Triangles (K, 3, 3) of an even net of axis-parallel edges, in three planes: every box is flat."""
    corners = []
    for i, j in itertools.product(range(size), repeat=2):
        a, b, c, d = ([i + x, j + y, 0] for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
        corners += [[a, b, c], [a, c, d]]
    flat = np.array(corners, dtype=np.float64)
    return np.concatenate([np.roll(flat, axis, axis=2) for axis in range(3)])


@EVERYWHERE
def test_vertices_and_edges_are_hit_through_the_tree(place: list[float]) -> None:
    rng = np.random.default_rng(1)
    corners = np.concatenate((soup(rng, 150, 0.5), lattice(5))) + place
    a, b, c = (corners[rng.integers(0, len(corners), 4000), i] for i in range(3))
    share = rng.choice([0.0, 0.25, 1 / 3, 0.5, 1.0], (4000, 1))
    targets = np.concatenate((a, a + share * (b - a), c + share * (a - c)))
    origins = place + rng.normal(size=targets.shape) * 4
    found = both_ways(corners, origins, targets - origins)
    assert np.isfinite(found.t).mean() > 0.5


@EVERYWHERE
def test_planes_of_boxes_lose_no_ray(place: list[float]) -> None:
    rng = np.random.default_rng(2)
    corners = lattice(6) + place
    # Whole and half numbers: in the planes of the boxes, on edges, on vertices, and between.
    origins = place + rng.integers(-4, 16, (6000, 3)) / 2
    directions = np.where(rng.random((6000, 3)) < 0.6, 0.0, rng.choice([-1.0, 1.0, 0.5], (6000, 3)))
    directions[~directions.any(axis=1)] = [0, 0, 1]
    signed = directions * np.where(directions == 0, rng.choice([-1.0, 1.0], (6000, 3)), 1)
    assert np.signbit(signed[signed == 0]).any()
    found = both_ways(corners, origins, signed)
    np.testing.assert_array_equal(found.t, hits_of(corners, origins, directions, tree=True).t)
    assert np.isfinite(found.t).any()


@EVERYWHERE
def test_borders_of_boxes_lose_no_ray(place: list[float]) -> None:
    """Woop's test takes what is within its rounding of the border; a box must not be narrower."""
    rng = np.random.default_rng(3)
    corners = np.concatenate((lattice(4), soup(rng, 60, 1.0))) + place
    vertex = corners[rng.integers(0, len(corners), 20000), rng.integers(0, 3, 20000)]
    other = corners[rng.integers(0, len(corners), 20000), rng.integers(0, 3, 20000)]
    share = rng.choice([0.0, 0.0, 0.5, 0.7], (20000, 1))
    size = np.abs(corners).max()
    hair = rng.integers(-9, 10, (20000, 3)) * size * 2.0**-54
    targets = vertex + share * (other - vertex) + hair
    reach = 10.0 ** rng.integers(-7, 4, (20000, 1))
    directions = np.where(rng.random((20000, 3)) < 0.3, 0.0, rng.normal(size=(20000, 3)))
    directions[~directions.any(axis=1)] = [1, 0, 0]
    both_ways(corners, targets - reach * directions, directions)


def test_equal_hits_show_the_first_shape() -> None:
    rng = np.random.default_rng(4)
    corners = soup(rng, 90, 0.8)
    twice = np.concatenate((corners, corners[::-1], corners))
    origins = rng.normal(size=(3000, 3)) * 4
    targets = corners[rng.integers(0, 90, 3000)].mean(axis=1)
    found = both_ways(twice, origins, targets - origins)
    assert (found.shapes < 90).all()
    flat = both_ways(
        np.concatenate((lattice(4), lattice(4))), origins, rng.integers(0, 4, (3000, 3)) - origins
    )
    assert flat.shapes.max() < len(lattice(4))


def test_coplanar_triangles_from_far_away_are_hit_in_their_order() -> None:
    """From up to 12,000 units, where boxes seem to begin behind a hit that is known."""
    rng = np.random.default_rng(7)
    corners = rng.integers(-2048, 2048, (60, 3, 3)) / 1024
    corners[..., 2] = 0.5
    targets = np.concatenate((corners.mean(axis=1)[:, :2], np.full((60, 1), 0.5)), axis=1)
    for away in (64, 4096):
        origins = np.round(rng.normal(size=(1500, 3)) * away)
        both_ways(corners, origins, np.round(targets[rng.integers(0, 60, 1500)] * 1024) / 1024 - origins)


def test_ray_that_is_not_finite_misses_and_changes_no_other() -> None:
    rng = np.random.default_rng(5)
    corners = soup(rng, 300, 0.4)
    origins = rng.normal(size=(900, 3)) * 4
    rays = np.hstack((origins, corners[rng.integers(0, 300, 900)].mean(axis=1) - origins))
    bad, part = np.arange(900) % 3 == 0, rng.integers(0, 6, 900)
    rays[bad, part[bad]] = rng.choice([np.nan, np.inf, -np.inf], 300)
    shapes = [mesh(corners.reshape(-1, 3), np.arange(900).reshape(-1, 3))]
    together, alone = (
        traced(shapes, given[:, :3], given[:, 3:], lights=[bulb([0, 9, 0])]) for given in (rays, rays[~bad])
    )
    assert (together.shape[bad] == -1).all()
    assert not together.visibility[bad].any()
    assert (together.t[~bad] == alone.t).all()
    assert (together.visibility[~bad] == alone.visibility).all()


def test_points_and_slivers_are_hit_by_nothing() -> None:
    rng = np.random.default_rng(5)
    points = np.repeat(rng.normal(size=(40, 1, 3)), 3, axis=1)
    ends = rng.integers(-8, 9, (40, 2, 3)) / 4
    lines = np.stack((ends[:, 0], ends[:, 1], (ends[:, 0] + ends[:, 1]) / 2), axis=1)
    shape = mesh(np.concatenate((points, lines)).reshape(-1, 3), np.arange(240).reshape(-1, 3))
    targets = np.concatenate((points, lines)).reshape(-1, 3)
    assert (traced([shape], *towards([3.0, 4.0, 5.0], targets)).shape == -1).all()


LIGHTS = {
    "rectangle": lamp([-1, 5, -1], [2, 0, 0], [0, 0.2, 2]),
    "small rectangle": lamp([0, 2.5, 0], [0.1, 0, 0], [0, 0, 0.1]),
    "point": bulb([0.3, 2.2, 0.1]),
    "directional": sun([0.1, -1, 0.2]),
}


def seen(corners: Floats, light: Json, pattern: str, origins: Floats, targets: Floats) -> tuple[Any, Any]:
    """The shadows of one light, as a plan casts them, and what rays from origins to targets hit."""
    sampling = sampled(1, 16, light=pattern)
    plan = plan_of(
        scene(*(triangle(*rows) for rows in corners.tolist()), lights=[light], sampling=sampling), DOUBLE
    )
    numbers = np.arange(len(origins))
    rays = Rays(origins.T.copy(), (targets - origins).T.copy(), numbers, np.zeros_like(numbers))
    points = intersect(plan, rays, lights=False)
    (lighting,) = compile_visibility(plan)
    assert isinstance(lighting.shadows[0], TreeShadows)
    return lighting, points


def hidden_by(lighting: Any, points: Any, shadows: Any) -> Any:
    """Pairs (light points, points) that are hidden or below the horizon."""
    view = replace(lighting, shadows=(shadows,)).view(points, Workspace())
    dark = ~view.above_horizon(view.of_points(points.normals))
    return dark if view.blocked is None else view.blocked | dark


def hidden_pairs(corners: Floats, light: Json, pattern: str, origins: Floats, targets: Floats) -> Any:
    """Pairs (light points, points) that are hidden or below the horizon, by the tree and one by one."""
    lighting, points = seen(corners, light, pattern, origins, targets)
    (stage,) = lighting.shadows
    one_by_one = ScatterPolygonShadows(stage.family.occluders(), lighting.emitter, lighting.dtype, False)
    return [hidden_by(lighting, points, shadows) for shadows in (stage, one_by_one)]


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
@pytest.mark.parametrize("pattern", ["uniform", "sobol"])
@pytest.mark.parametrize("size", [1.0, *(pytest.param(x, marks=pytest.mark.slow) for x in (0.1, 0.4))])
@pytest.mark.parametrize("count", [33, *(pytest.param(x, marks=pytest.mark.slow) for x in (60, 2000))])
def test_shadows_are_those_of_every_triangle(light: Json, pattern: str, size: float, count: int) -> None:
    """Light points within a rounding of a triangle's border do not come up in random scenes."""
    rng = np.random.default_rng(6)
    corners = soup(rng, count, size)
    origins = rng.normal(size=(500, 3)) * [2, 0.5, 2] + [0, 3, 0]
    targets = corners[rng.integers(0, count, 500)].mean(axis=1)
    found, true = hidden_pairs(corners, light, pattern, origins, targets)
    np.testing.assert_array_equal(found, true)
    assert true.any() or size < 1
    assert not true.all() or size == 1


CULLED = {
    "above": lamp([-0.7, 5, -0.7], [1.5, 0, 0], [0, 0.1, 1.5]),
    "amid the mesh": lamp([-0.7, 0.1, -0.7], [1.5, 0, 0], [0, 0.1, 1.5]),
    "skewed": lamp([-0.7, 3, -0.7], [1.5, 0, 0], [1, 0, 1.5]),
    "narrow": lamp([-0.2, 3, -0.7], [2.0**-20, 0, 0], [0, 0.1, 1.5]),
    "almost in line": lamp([-0.7, 3, -0.7], [1.5, 0, 0], [1.5, 0, 2.0**-20]),
}


@pytest.mark.parametrize("unit", [2.0**-40, 1.0, 2.0**40], ids=["tiny", "as they are", "huge"])
@pytest.mark.parametrize("light", CULLED.values(), ids=CULLED)
def test_shafts_leave_out_triangles_beside_a_light_only(light: Json, unit: float) -> None:
    rng = np.random.default_rng(8)
    corners = soup(rng, 600, 0.1)
    # Some points lie in the planes of lights, where the pyramid to the light is flat.
    corners[::10, :, 1] = 3.0
    origins = rng.normal(size=(400, 3)) * [2, 0.5, 2] + [0, 4, 0]
    targets = corners[rng.integers(0, 600, 400)].mean(axis=1)
    sides = {name: (np.array(light[name]) * unit).tolist() for name in ("corner", "edges")}
    lighting, points = seen(corners * unit, light | sides, "sobol", origins * unit, targets * unit)
    (stage,) = lighting.shadows
    found = hidden_by(lighting, points, stage)
    stage.frame = None
    np.testing.assert_array_equal(found, hidden_by(lighting, points, stage))
    assert found.any()


@pytest.mark.parametrize("name", ["above", "amid the mesh", "skewed"])
def test_shafts_leave_out_from_the_border_of_the_light_on(name: str) -> None:
    """Tiny triangles in the way from points of a floor to the border of a light, and to beside it."""
    light = CULLED[name]
    rng = np.random.default_rng(9)
    points = rng.uniform(-3, 3, (400, 3)) * [1, 0, 1] - [0, 1, 0]
    border = np.where(np.arange(400) % 2, 0.5, 0.5 + 2.0**-8) * rng.choice([-1.0, 1.0], 400)
    places = np.stack((border, rng.uniform(-0.5, 0.5, 400)))[[[0, 1], [1, 0]][rng.integers(2)]]
    corner, edges = np.array(light["corner"]), np.array(light["edges"])
    towards_border = corner + (places.T + 0.5) @ edges - points
    tiny = points + rng.uniform(0.2, 0.9, (400, 1)) * towards_border
    tiny = tiny[:, None] + 2.0**-32 * rng.uniform(-1, 1, (400, 3, 3))
    floor = np.array([[[-99.0, -1, -99], [0, -1, 199], [99, -1, -99]]])
    lighting, hits = seen(np.concatenate((floor, tiny)), light, "sobol", np.add(points, [0, 1, 0]), points)
    view = replace(lighting, shadows=()).view(hits, Workspace())
    assert view.count == 400
    frame = lighting.shadows[0].frame
    kept = frame.overlapping(frame.pyramids(view), np.arange(400), np.arange(1, 401))
    assert set(range(1, 400, 2)) <= set(kept.tolist())
    assert kept.size < 220


def test_shadow_scenes_cross_both_thresholds() -> None:
    """The scenes above have points whose shafts reach few nodes at every level, and points of many."""
    rng = np.random.default_rng(6)
    shapes = family(soup(rng, 2000, 0.4))
    points = rng.uniform(-2, 2, (3, 500))
    low, high = np.array([[-1.0], [5], [-1]]), np.array([[1.0], [5.2], [1]])
    shafts = Shafts(points, low - points, high - points, False, np.zeros((3, 500)), np.zeros(500))
    levels = tree_of(shapes).levels
    for depth, most in ((SHAFT_LEVELS, FEW_NODES[0]), (SHAFT_LEVELS + 1, FEW_NODES[1])):
        visits = visits_of_shafts(levels[:depth], shafts, bvh.from_root(np.arange(500)))
        few = np.bincount(visits.rays, minlength=500) <= most
        assert 0 < few.mean() < 1


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_a_light_that_touches_the_mesh_gives_finite_answers(light: Json) -> None:
    vertices, faces = solids.icosphere([0, 0, 0], 1.0, 2)
    at = light.get("position") or light.get("corner") or [0, 1.5, 0]
    vertices = vertices - vertices[5] + at
    origin = [at[0] + 0.5, at[1] + 3, at[2] + 0.2]
    hits = traced([mesh(vertices, faces)], *towards(origin, vertices), lights=[light], points=4)
    assert np.isfinite(hits.visibility).all()
