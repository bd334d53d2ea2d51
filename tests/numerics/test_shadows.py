"""Shadow rays: own shadows, covers, seams, slivers, corners, and lights at horizons and in planes."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

import renderer
from renderer.math.arrays import unit
from tests import solids
from tests.documents import (
    bulb,
    camera,
    dark_scene,
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
from tests.numerics.places import (
    COVERS,
    FLOORS,
    OFFSETS,
    PARTS,
    PATTERNS,
    SCALES,
    Place,
    View,
    bare,
    covered,
    floor,
    grid,
    lights,
    on_seams,
    places,
    rising,
    room,
    seen_in_room,
)
from tests.numerics.tracing import QUALITIES, points, radiance
from tests.pictures.parts import plan_of

Floats = np.ndarray
BOTH = pytest.mark.parametrize("quality", QUALITIES, ids=["single", "double"])


@pytest.mark.parametrize("kind", FLOORS)
def test_floor_is_not_in_its_own_shadow(kind: str) -> None:
    """From 0 to 1e7 times its size from the origin, and in units of 2^-20 to 2^20."""
    where = itertools.chain(places(f"acne {kind}"), places(f"units {kind}", (0.0, 1e3), SCALES[::2]))
    for number, (chosen, place) in enumerate(where):
        bare(kind, place, chosen).check(QUALITIES[number % 2], PATTERNS[number // 2 % 4])


@pytest.mark.parametrize("radius", [1e-3, 1.0, 1e3])
def test_ball_is_in_its_own_shadow_behind_the_horizon(radius: float) -> None:
    for number, (chosen, place) in enumerate(places(f"ball {radius}", scales=(radius,))):
        ball, other = (sphere(place.at(*np.full(3, way)), radius) for way in (0.0, 90.0))
        light = place.at(3, 2, 1)
        origins = place.at(*unit(chosen.normal(size=(3, 80))) * 5)
        plan = plan_of(scene(ball, other, lights=[bulb(light)]), QUALITIES[number % 2])
        hits = renderer.trace(plan, origins, place.center - origins)
        away = light - hits.position
        cosines = (hits.normal * away).sum(axis=1) / np.linalg.norm(away, axis=1)
        sure = np.abs(cosines) > 2.0**-48 * (1 + OFFSETS[number])
        assert (hits.shape == 0).all()
        assert (hits.visibility[sure, 0] == (cosines > 0)[sure]).all()


@pytest.mark.parametrize("above", COVERS)
@pytest.mark.parametrize("kind", FLOORS)
def test_cover_just_above_the_floor_shades_it(kind: str, above: str) -> None:
    """At a thousandth of the way to the lights and more."""
    for share in (1e-3, 0.03, 0.9):
        for number, (chosen, place) in enumerate(places(f"detached {kind} {above} {share}", (0.0, 1e7))):
            covered(kind, above, share, place, chosen).check(QUALITIES[number % 2], PATTERNS[number])


@pytest.mark.parametrize("kind", FLOORS)
def test_seam_of_a_floor_is_lit(kind: str) -> None:
    for number, (chosen, place) in enumerate(places(f"seams {kind}", turns=2)):
        on_seams(kind, place, chosen).check(QUALITIES[number % 2], PATTERNS[number // 2 % 4])


@pytest.mark.parametrize("shining", ["bulb", "sun"])
@pytest.mark.parametrize("kind", FLOORS)
def test_seam_of_a_cover_lets_no_light_through(kind: str, shining: str) -> None:
    """The light is straight behind the seam."""
    upright = (np.random.default_rng(1), Place(np.zeros(3), np.eye(3), 1.0))
    for number, (chosen, place) in enumerate([upright, *places(f"under {kind}")]):
        lifted = Place(place.at(0, 0, 2), place.axes, place.unit)
        vertices, faces = grid(lifted, np.linspace(-5, 5, PARTS[kind] + 1), 0.0)
        seams = solids.edge_places(vertices, np.array(faces), [0.0, 0.25, 1 / 3, 0.5])
        within = np.abs((seams - place.center) @ place.axes[:2].T).max(axis=1) < 4.9 * place.unit
        seams = chosen.permutation(seams[within])[:60]
        light = bulb(place.at(0, 0, 4)) if shining == "bulb" else sun(place.way(0, 0, -1))
        away = seams - place.at(0, 0, 4) if shining == "bulb" else place.way(0, 0, np.full(len(seams), -2))
        origins = seams + away + place.way(0.25, 0, 1)
        ground = rectangle(place.at(-20, -20, 0), place.way(40, 0, 0), place.way(0, 40, 0))
        shapes, dark = [ground, *floor(kind, lifted)], np.zeros((len(seams), 1))
        View(shapes, [light], 1, origins, seams + away - origins, dark).check(QUALITIES[number % 2])


@pytest.mark.parametrize("thin", [1e-2, 1e-8])
@pytest.mark.parametrize("kind", ["triangle", "rectangle"])
def test_sliver_is_lit(kind: str, thin: float) -> None:
    """Four units long, seen and lit from above."""
    for number, (chosen, place) in enumerate(places(f"sliver {kind} {thin}", offsets=(0.0, 1.0))):
        a, b, c = place.at([-2.0, 2.0, 0.3], [0, 0, thin / 2], 0)
        sliver = rectangle(a, b - a, c - a) if kind == "rectangle" else triangle(a, b, c)
        targets = chosen.dirichlet([1, 1, 1], 40) @ np.array([a, b, c])
        origins = np.broadcast_to(place.at(0.3, 0.1, 2), targets.shape)
        below = rectangle(place.at(-9, -9, -9), place.way(1, 0, 0), place.way(0, 1, 0))
        shining = lights(place, place.way(-1, 0.2, 3))
        view = View([sliver, below], shining, 1, origins, targets - origins, np.ones((40, 3)))
        view.check(QUALITIES[number])


@pytest.mark.parametrize("offset", [1.0, 1e2, 1e4, 1e6])
def test_light_in_a_ceiling_is_not_hidden_by_it(offset: float) -> None:
    for number in range(4):
        chosen = np.random.default_rng([3, number, int(offset)])
        first, second = np.linalg.qr(chosen.normal(size=(3, 2)))[0].T
        corner, down = chosen.normal(size=3) * offset, np.cross(first, second)
        document = scene(
            rectangle(corner - first - second, 3 * first, 3 * second),
            rectangle(corner - 4 * down - 5 * (first + second), 10 * first, 10 * second),
            lights=[lamp(corner, first, second)],
            sampling=sampled(1, 16, light=PATTERNS[number]),
        )
        targets = corner - 4 * down + chosen.uniform(-4, 4, (125, 2)) @ np.stack((first, second))
        origins = np.broadcast_to(corner - 2 * down, targets.shape)
        hits = renderer.trace(plan_of(document, QUALITIES[number % 2]), origins, targets - origins)
        assert (hits.shape == 1).all()
        assert (hits.visibility == 1).all()


def floor_radiance(light: Any, x: Any, z: Any, quality: Any) -> Floats:
    """Radiance (N,) of a white floor at places seen from straight above."""
    ground = rectangle([0, 0, 0], [8, 0, 0], [0, 0, 8])
    document = dark_scene(ground, sphere([4, 9, 4], 1.0), lights=[light], sampling=sampled(1, 16))
    zero, one = np.zeros(x.size), np.ones(x.size)
    return radiance(plan_of(document, quality), np.stack((x, one, z)), np.stack((zero, -one, zero)))[0]


@BOTH
@pytest.mark.parametrize("exponent", [1, 5, 13, 20, 100, 300])
def test_light_that_touches_the_floor_lights_it_by_its_cosine(exponent: int, quality: Any) -> None:
    """A bulb just above, and a lamp that stands on the floor and is 1e-300 of a unit away."""
    near = 10.0**-exponent
    x, z = near * np.array([[0.0, 0.5, 1, 3], [0, 0.25, 1, 0]])
    light, away = bulb([0, near, 0], [1, 1, 1]), np.hypot(np.hypot(x, z), near)
    assert np.abs(floor_radiance(light, x, z, quality) - near / away).max() <= 2.0**-20
    if exponent < 14:
        squared = near / away**3
        physical = floor_radiance({**light, "falloff": "physical"}, x, z, quality)
        assert (np.abs(physical - squared) <= 2.0**-18 * squared).all()
    x, z = np.array([0.3, 0.7, 1.0]), near * np.array([1.0, 3.0, 0.0])
    standing = lamp([0, 0, 0], [1, 0, 0], [0, 2, 0], [1, 1, 1], visible=False)
    across, up = (np.arange(4) + 0.5)[:, None, None] / 4, (np.arange(4) + 0.5)[:, None] / 2
    cosines = (up / np.hypot(np.hypot(x - across, z), up)).mean(axis=(0, 1))
    assert np.abs(floor_radiance(standing, x, z, quality) - cosines).max() <= 2.0**-20


@pytest.mark.parametrize("offset", [0.0, 1e2, 1e4, 1e6])
def test_terminator_of_a_coarse_mesh_has_no_light_from_behind(offset: float) -> None:
    """Hills of few facets with smooth normals, a sun 10 degrees above them."""
    for number, (chosen, place) in enumerate(places("terminator", offsets=(offset,), turns=2)):
        steps = np.linspace(-2, 2, 7)
        x, y = (part.ravel() for part in np.meshgrid(steps, steps, indexing="ij"))
        vertices, faces = grid(place, steps, 0.4 * np.sin(2.1 * x) * np.cos(1.7 * y))
        ray = place.way(np.cos(np.pi / 18), 0, np.sin(np.pi / 18))
        plan = plan_of(
            dark_scene(mesh(vertices, faces, smooth=True), lights=[sun(-ray, [1, 1, 1])]), QUALITIES[number]
        )
        targets = place.at(*chosen.uniform(-1.9, 1.9, (2, 200)), 0)
        origins = targets + place.way(0, 0, 9)
        found, seen = (ask(plan, origins.T, (targets - origins).T) for ask in (points, radiance))
        visible = renderer.trace(plan, origins, targets - origins).visibility[:, 0]
        true, shading = ray @ found.normals, ray @ found.shading_normals
        assert not seen[0][true <= 0].any()
        expected = np.maximum(shading, 0.0) * visible
        assert np.abs(seen[0] - expected)[true > 0].max() <= 2.0**-20


@BOTH
@pytest.mark.parametrize("pattern", PATTERNS)
def test_light_below_the_horizon_or_in_the_plane_gives_nothing(pattern: str, quality: Any) -> None:
    """And costs no shadow ray where it is below."""
    below = [bulb([0.5, -1, 0]), sun([0.2, 1, 0.1]), lamp([-1, -2, -1], [2, 0, 0], [0, 0.5, 2])]
    away = lamp([-1, 3, -1], [0, 0, 2], [2, 0, 0], two_sided=False, visible=False)
    within = [bulb([9, 0, 0]), lamp([8, 0, 8], [1, 0, 0], [0, 0, 1])]

    def result(given: list[Any]) -> renderer.RenderResult:
        document = scene(
            rectangle([-7, 0, -7], [0, 0, 14], [14, 0, 0]),
            sphere([0, 6, 0], 1.0),
            lights=given,
            camera=camera(position=[0, 2, 0.5], look_at=[0, 0, 0]),
            materials={"plain": phong(specular=0.5, shininess=0)},
            sampling=sampled(1, 9, light=pattern),
        )
        return renderer.render(plan_of(document, quality))

    dark = result([])
    assert (result(within).image == dark.image).all()
    lit = result([*below, away])
    assert (lit.image == dark.image).all()
    assert lit.report["rays"]["shadow"] == 0


MIRRORS = pytest.mark.parametrize("mirrors", [(), (0,), (0, 1, 2)], ids=["no mirror", "one", "three"])


def rooms(name: str) -> Any:
    """Turned and upright places of all sizes, near and far, with numbers to draw from."""
    for chosen, place in places(name, offsets=(0.0, 1e7), scales=SCALES[::4]):
        yield chosen, place
        # Along the axes, where planes and edges are exact.
        yield chosen, Place(place.center, np.eye(3), place.unit)


@pytest.mark.parametrize("kind", FLOORS)
@MIRRORS
def test_corner_of_a_lit_room_is_never_dark(mirrors: tuple[int, ...], kind: str) -> None:
    """A room is convex: its lights reach every wall, and a path of at most four bounces ends at one."""
    for number, (chosen, place) in enumerate(rooms("mirrors")):
        shapes, quality = room(kind, place, mirrors), QUALITIES[number % 2]
        assert (seen_in_room(shapes, place, chosen, quality, PATTERNS[number % 4]) > 0).all()


@pytest.mark.parametrize("kind", FLOORS)
@pytest.mark.parametrize("degrees", [90.0, 50.0, 20.0, 1.0])
def test_foot_of_a_sharp_corner_is_dark(kind: str, degrees: float) -> None:
    """Three walls on one line, seen within 1e-14 of it from between the outer two; lights behind."""
    angle = math.radians(degrees)
    for number, (chosen, place) in enumerate(places(f"sharp {kind} {degrees}", offsets=(0.0, 1e3, 1e7))):
        walls = list(itertools.chain(*(rising(kind, place, share * angle) for share in (0, 1, 0.45))))
        away, within = math.pi + angle / 2, angle * chosen.choice([0.2, 0.8])
        behind = place.at(5 * math.cos(away), 5 * math.sin(away), 0.3)
        edges = place.way(0, 0, 0.8), place.way(-0.3 * math.sin(away), 0.3 * math.cos(away), 0)
        foot = place.at(10.0 ** chosen.uniform(-17, -14, 40), 0, chosen.uniform(-3, 3, 40))
        eye = np.tile(place.at(2.5 * math.cos(within), 2.5 * math.sin(within), 0.2), (40, 1))
        shining = [bulb(behind), lamp(behind, *edges)]
        view = View(walls, shining, len(walls), eye, foot - eye, np.zeros((40, 2)))
        view.check(QUALITIES[number % 2], PATTERNS[number % 4])
