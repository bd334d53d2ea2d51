"""Pilot samples of a light: which points see all of it, or none, and how near the mean comes."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from accuracy.hard_cases.documents import bulb, lamp, phong, rectangle, scene, sphere
from renderer.adaptive.lighting import SIDES, PilotLighting, corners_for
from renderer.integrator import intersect, workspace
from renderer.interaction import Points, Rays
from renderer.plan.plan import pilot_of
from schemas.quality import TargetQuality

Numbers = NDArray[np.float64]

LAMP = lamp([-0.5, 3, -0.5], [1, 0, 0], [0, 0, 1], (0.9, 0.6, 0.3), visible=False)
FLOOR = rectangle([-9, 0, -9], [0, 0, 18], [18, 0, 0])
SCREEN = rectangle([-0.5, 1.5, -0.5], [0, 0, 1], [1, 0, 0])
"""Halfway between floor and lamp, and as large as it: (x, z) on the floor and (u, v) on the lamp do not see
each other where x + u and z + v are within 1 of 0."""
COLOR = np.array([[0.9], [0.6], [0.3]])


def plan_of(*shapes: Any, error: float = 4 / 255, **changes: Any) -> renderer.RenderPlan:
    document = scene(*shapes, **{"lights": [LAMP], **changes})
    return pilot_of(renderer.compile_scene(document, TargetQuality(mode="target", error=error)))


def pilot_sample(plan: renderer.RenderPlan) -> PilotLighting:
    (lighting,) = plan.lightings
    assert isinstance(lighting, PilotLighting)
    return lighting


def points_on_floor(
    plan: renderer.RenderPlan, x: Numbers, z: Numbers, viewers: Numbers | None = None
) -> Points:
    """Points of the floor as seen from a hand above it, straight down or along -viewers (3, N)."""
    down = np.zeros((3, x.size)) if viewers is None else -viewers
    if viewers is None:
        down[1] = -1
    origins = np.stack((x, np.zeros(x.size), z)) - down / np.abs(down[1]) * 0.1
    numbers = np.arange(x.size)
    rays = Rays(origins, down, numbers, np.zeros_like(numbers))
    points = intersect(plan, rays, lights=False)
    assert points.count == x.size
    assert np.abs(points.positions[1]).max() <= 1e-12
    return points


def added(plan: renderer.RenderPlan, points: Points) -> tuple[Numbers, int]:
    """What the light adds to the points, (3, N), and the shadow rays that it took."""
    before = points.radiance.copy()
    rays = pilot_sample(plan).run(points, workspace())
    return points.radiance - before, rays


CELLS = 64
"""Along each side of a part of the lamp for what is exact: 4 times the finest of the grids that are tried."""


def part_of(bounds: Numbers, points: Points, specular: float, shininess: float) -> Numbers:
    """What the part u0, u1, v0, v1 (4, N) of `LAMP` gives a floor of `phong()` with a highlight, (3, N)."""
    cells = (np.arange(CELLS) + 0.5)[:, None, None] / CELLS
    u0, u1, v0, v1 = bounds
    x, _, z = points.positions
    to = np.stack(
        np.broadcast_arrays(u0 + cells * (u1 - u0) - x, 3.0, (v0 + cells * (v1 - v0) - z)[:, 0][None])
    )
    to = to / np.sqrt((to * to).sum(axis=0))
    right, up, front = points.viewers
    mirrored = np.maximum(to[1] * up - to[0] * right - to[2] * front, 0)
    weight = (u1 - u0) * (v1 - v0)
    matt, shine = to[1].mean(axis=(0, 1)) * weight, (mirrored**shininess).mean(axis=(0, 1)) * weight
    return COLOR * (0.9 * np.array([[0.8], [0.7], [0.6]]) * matt + specular * shine)


def exact(
    points: Points, *, screened: bool = False, specular: float = 0.0, shininess: float = 1.0
) -> Numbers:
    """The light of `LAMP`, but for the part that `SCREEN` hides."""
    x, _, z = points.positions
    half = np.full(x.size, 0.5)
    whole = part_of(np.stack((-half, half, -half, half)), points, specular, shininess)
    if not screened:
        return whole
    hidden = np.clip(np.stack((-1 - x, 1 - x, -1 - z, 1 - z)), -0.5, 0.5)
    return whole - part_of(hidden, points, specular, shininess)


def places(seed: int, count: int, reach: float) -> tuple[Numbers, Numbers]:
    x, z = np.random.default_rng(seed).uniform(-reach, reach, (2, count))
    return x, z


def beyond(x: Numbers, z: Numbers, bound: float) -> NDArray[np.bool_]:
    return np.maximum(np.abs(x), np.abs(z)) > bound


@pytest.mark.parametrize("error", [0.1, 4 / 255, 1 / 1024])
def test_visible_light_within_a_quarter_of_the_error(error: float) -> None:
    plan = plan_of(FLOOR, SCREEN, error=error)
    x, z = places(1, 200, 5)
    outside = beyond(x, z, 1.5)
    points = points_on_floor(plan, x[outside], z[outside])
    found, rays = added(plan, points)
    assert np.abs(found - exact(points)).max() <= error / 4
    assert rays == corners_for(error) ** 2 * points.count


@pytest.mark.parametrize(
    ("error", "specular", "shininess"),
    [(4 / 255, 0.6, 8.0), (4 / 255, 0.4, 60.0), (4 / 255, 1.0, 30.0), (1 / 1024, 0.6, 8.0)],
)
def test_highlight_within_a_quarter_of_the_error(error: float, specular: float, shininess: float) -> None:
    """Seen from everywhere around the mirror image of the lamp, where the finest grid is fine enough."""
    shiny = {"plain": phong(specular=specular, shininess=shininess)}
    plan = plan_of(FLOOR, error=error, materials=shiny)
    x, z = places(2, 150, 2)
    viewers = np.stack((x, np.full(x.size, 3.0), z)) + np.random.default_rng(3).uniform(-0.9, 0.9, (3, 150))
    points = points_on_floor(plan, x, z, viewers / np.sqrt((viewers**2).sum(axis=0)))
    found, _ = added(plan, points)
    expected = exact(points, specular=specular, shininess=shininess)
    assert (expected - exact(points)).max() > specular / 4
    assert np.abs(found - expected).max() <= error / 4


def test_hidden_light_is_black() -> None:
    plan = plan_of(FLOOR, SCREEN)
    x, z = places(4, 100, 0.49)
    points = points_on_floor(plan, x, z)
    found, rays = added(plan, points)
    assert not found.any()
    assert rays == corners_for(4 / 255) ** 2 * 100


def test_shadow_rays_go_to_penumbrae() -> None:
    plan = plan_of(FLOOR, SCREEN)
    x, z = places(5, 400, 3)
    part = beyond(x, z, 0.5) & ~beyond(x, z, 1.5)
    assert 50 < part.sum() < 300
    many = pilot_sample(plan).partial.emitter.count
    _, rays = added(plan, points_on_floor(plan, x, z))
    assert rays == corners_for(4 / 255) ** 2 * 400 + many * part.sum()


@pytest.mark.parametrize(
    ("error", "many"), [(1.0, 8), (2.0**-6, 16), (2.0**-8, 64), (2.0**-10, 256), (1e-6, 1024)]
)
def test_smaller_error_takes_more_points(error: float, many: int) -> None:
    assert pilot_sample(plan_of(FLOOR, SCREEN, error=error)).partial.emitter.count == many


@pytest.mark.parametrize("error", [2.0**-6, 2.0**-8, 2.0**-10])
def test_penumbra_is_as_near_as_stratified(error: float) -> None:
    """By the root of the mean square over it, in shares of what the whole light gives.

    The border of what a rectangle hides goes through at most 2 sqrt(n) of n square cells with a point each.
    Where it hides a share f of a cell, uniform on 0..1, the point has variance f (1 - f), in the mean 1 / 6.
    """
    plan = plan_of(FLOOR, SCREEN, error=error)
    n = pilot_sample(plan).partial.emitter.count
    x, z = places(6, 300, 1.5)
    part = beyond(x, z, 0.5)
    points = points_on_floor(plan, x[part], z[part])
    found, _ = added(plan, points)
    share = (found - exact(points, screened=True)) / exact(points)
    assert np.sqrt((share**2).mean()) <= np.sqrt(2 * np.sqrt(n) / 6) / n


def test_hidden_corner_of_a_light_is_found() -> None:
    """At the border of the penumbra, where next to nothing of the light is hidden."""
    plan = plan_of(FLOOR, SCREEN)
    edge = np.array([1.5, 1.5, -1.5, 0.3])
    for inside, expected in ((1 - 1e-6, 4), (1 + 1e-6, 0)):
        points = points_on_floor(plan, edge * inside, np.array([1.5, 0.2, 1.5, -1.5]) * inside)
        _, rays = added(plan, points)
        assert rays == corners_for(4 / 255) ** 2 * 4 + pilot_sample(plan).partial.emitter.count * expected


def beside_ball(points: Points, radius: float) -> Numbers:
    """The light of `LAMP`, but for what a ball halfway up hides: its span of each of many lines along u."""
    x, _, z = points.positions
    v = ((np.arange(512) + 0.5) / 512 - 0.5)[:, None]
    power = x**2 + 2.25 + z**2 - radius**2
    a, b = x**2 - power, z * (v - z) - 4.5
    c = b**2 - power * (9 + (v - z) ** 2)
    root = np.sqrt(np.maximum((x * b) ** 2 - a * c, 0))
    ends = np.sort(np.stack([(-x * b - root) / a + x, (-x * b + root) / a + x]), axis=0)
    ends = np.where(root > 0, np.clip(ends, -0.5, 0.5), 0.0)
    nodes, shares = np.polynomial.legendre.leggauss(8)
    half = (ends[1] - ends[0]) / 2
    u = (ends[0] + ends[1]) / 2 + nodes[:, None, None] * half
    cosines = 3 / np.sqrt((u - x) ** 2 + 9 + (v - z) ** 2)
    hidden = (half * (shares[:, None, None] * cosines).sum(axis=0)).mean(axis=0)
    return exact(points) - COLOR * (0.9 * np.array([[0.8], [0.7], [0.6]]) * hidden)


@pytest.mark.parametrize("error", [0.5 / 255, 0.25 / 255, 0.1 / 255])
def test_ball_between_two_probes(error: float) -> None:
    """At the border of its penumbra, where with four probes along a side none of them is hidden."""
    plan = plan_of(FLOOR, sphere([0, 1.5, 0], 0.35), error=error)
    x, z = np.random.default_rng(8).uniform([[1.29], [-0.05]], [[1.3], [0.05]], (2, 400))
    points = points_on_floor(plan, x, z)
    found, _ = added(plan, points)
    expected = beside_ball(points, 0.35)
    assert (exact(points) - expected).mean(axis=1).max() > 0.4 / 255
    assert np.abs((found - expected).mean(axis=1)).max() <= error / 4


def test_near_points_take_a_finer_grid() -> None:
    plan = plan_of(FLOOR, error=1 / 1024)
    lighting = pilot_sample(plan)
    points = points_on_floor(plan, np.array([0.0, 3.0, 8.5]), np.array([0.0, 1.0, 8.5]))
    view = lighting.probe.view(points, workspace())
    cells = np.array(SIDES)[lighting.sides(view, np.arange(3))]
    assert (np.diff(cells) <= 0).all()
    assert cells[0] > cells[2]


def test_single_shape_takes_no_shadow_rays() -> None:
    plan = plan_of(FLOOR)
    x, z = places(7, 100, 4)
    points = points_on_floor(plan, x, z)
    found, rays = added(plan, points)
    assert rays == 0
    assert not pilot_sample(plan).casts
    assert np.abs(found - exact(points)).max() <= 1 / 255


def test_points_behind_a_light() -> None:
    light = lamp([-0.5, 3, -0.5], [0, 0, 1], [1, 0, 0], two_sided=False, visible=False)
    found, towards = [], [light, light | {"edges": light["edges"][::-1]}]
    for turned in towards:
        plan = plan_of(FLOOR, SCREEN, rectangle([-9, 9, -9], [18, 0, 0], [0, 0, 18]), lights=[turned])
        found.append(added(plan, points_on_floor(plan, np.array([2.0, 0.0]), np.array([2.0, 0.0]))))
    assert sorted(rays for _, rays in found) == [0, corners_for(4 / 255) ** 2 * 2]
    assert sorted(bool(light.any()) for light, _ in found) == [False, True]


def test_point_lights_are_sampled_as_always() -> None:
    plan = plan_of(FLOOR, SCREEN, lights=[bulb([0, 3, 0])])
    assert not any(isinstance(lighting, PilotLighting) for lighting in plan.lightings)
