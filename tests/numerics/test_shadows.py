"""Visibility of lights where rounding decides: at surfaces, horizons, edges and ends of segments."""

from typing import Any

import numpy as np
import pytest

from renderer.hard_cases.documents import (
    bulb,
    camera,
    lamp,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    sun,
    triangle,
)
from tests.images.parts import DOUBLE, SINGLE, image_of
from tests.numerics.tracing import traced

BOTH = pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])
PATTERNS = pytest.mark.parametrize("pattern", ["uniform", "random", "sobol"])
OFFSETS = [0.0, 1e2, 1e4, 1e5, 1e7]


def turned(rng: np.random.Generator) -> Any:
    """Three perpendicular unit vectors as rows."""
    return np.linalg.qr(rng.normal(size=(3, 3)))[0].T


def seen_on_a_plane(rng: np.random.Generator, offset: float, covered: float | None, **options: Any) -> Any:
    """Visibility of a bulb and a lamp from a turned floor of four tiles, seen and lit at angles down to 3e-3.

    With `covered`, a tile floats at that share of the way to the lights, over all of the floor's middle.
    """
    across, along, up = turned(rng)
    center = rng.normal(size=3) * offset
    corners = [center + i * 10 * across + j * 10 * along for i in (-1, 0) for j in (-1, 0)]
    floor = [rectangle(c.tolist(), (10 * across).tolist(), (10 * along).tolist()) for c in corners]
    angle = 10 ** rng.uniform(-2.5, 0)
    # Over the middle of the floor, or as low over the horizon as the angle says.
    way = (np.cos(angle) * across + np.sin(angle) * up) * 8 if covered is None else up * 4
    lights = [bulb((center + way).tolist())]
    first, second = (0.1 * across).tolist(), (0.1 * along).tolist()
    lights.append(lamp((center + way).tolist(), first, second, visible=False))
    shapes = [*floor, sphere((center - 40 * up).tolist(), 1)]
    if covered is not None:
        corner = center + covered * way - 9 * across - 9 * along
        shapes.append(rectangle(corner.tolist(), (18 * across).tolist(), (18 * along).tolist()))
    targets = center + rng.uniform(-3, 3, (40, 1)) * across + rng.uniform(-3, 3, (40, 1)) * along
    view = 10 ** rng.uniform(-2.5, 0, (40, 1))
    # From below the tile that floats, so that the rays meet the floor.
    rise = view * up if covered is None else view * covered * up
    origins = targets + along * np.cos(view) + rise
    return traced(shapes, origins, targets - origins, lights=lights, points=9, **options)


@BOTH
@PATTERNS
@pytest.mark.parametrize("offset", OFFSETS)
def test_a_plane_never_shades_itself_nor_its_continuation(offset: float, pattern: str, quality: Any) -> None:
    rng = np.random.default_rng(1)
    for _ in range(12):
        hits = seen_on_a_plane(rng, offset, None, pattern=pattern, quality=quality)
        assert ((hits.shape >= 0) & (hits.shape < 4)).all()
        assert (hits.visibility == 1).all()


@BOTH
@PATTERNS
@pytest.mark.parametrize("offset", OFFSETS)
def test_what_floats_just_above_a_plane_casts_its_shadow(offset: float, pattern: str, quality: Any) -> None:
    rng = np.random.default_rng(2)
    for covered in (1e-3, 1e-2, 0.1, 0.3, 0.9):
        hits = seen_on_a_plane(rng, offset, covered, pattern=pattern, quality=quality)
        on_floor = (hits.shape >= 0) & (hits.shape < 4)
        assert on_floor.sum() >= 20
        assert (hits.visibility[on_floor] == 0).all()


@BOTH
@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("radius", [1e-3, 1, 1e3])
def test_a_ball_shades_itself_exactly_where_it_faces_away(offset: float, radius: float, quality: Any) -> None:
    rng = np.random.default_rng(3)
    center = rng.normal(size=3) * offset * min(radius, 1)
    ball, other = sphere(center.tolist(), radius), sphere((center + 90 * radius).tolist(), radius)
    light = center + np.array([3, 2, 1]) * radius
    origins = center + rng.normal(size=(300, 3)) * 5 * radius
    hits = traced([ball, other], origins, center - origins, lights=[bulb(light.tolist())], quality=quality)
    assert (hits.shape == 0).all()
    away = light - hits.position
    cosine = (hits.normal * away).sum(axis=1) / np.linalg.norm(away, axis=1)
    # The normal itself is as good as the ball's centre lets it be.
    doubt = 2.0**-48 * (1 + offset)
    assert (hits.visibility[cosine > doubt] == 1).all()
    assert (hits.visibility[cosine < -doubt] == 0).all()


@BOTH
def test_a_light_just_this_side_of_an_occluder_is_seen_and_just_beyond_is_not(quality: Any) -> None:
    screen = rectangle([-5, 1, -5], [10, 0, 0], [0, 0, 10])
    behind = rectangle([-5, -1e-3, -5], [10, 0, 0], [0, 0, 10])
    floor = rectangle([-5, 0, -5], [0, 0, 10], [10, 0, 0])
    for height, share in ((1 - 1e-3, 1), (1 + 1e-3, 0), (1.0, 1)):
        hits = traced(
            [floor, screen, behind],
            [[0.1, 0.5, 0.2]],
            [[0, -1, 0]],
            lights=[bulb([0.3, height, 0.4])],
            quality=quality,
        )
        assert (hits.shape.tolist(), hits.visibility.tolist()) == ([0], [[share]])


@BOTH
@PATTERNS
@pytest.mark.parametrize("kind", ["rectangle", "triangles"])
def test_a_light_that_is_half_covered_is_half_seen(kind: str, pattern: str, quality: Any) -> None:
    """The lamp's middle is over the screen's edge: half of any grid, or of 4096 points within 4 sigma."""
    floor = rectangle([-5, 0, -5], [0, 0, 10], [10, 0, 0])
    corners = [[0, 1, -9], [9, 1, -9], [9, 1, 9], [0, 1, 9]]
    screen = (
        [rectangle(corners[0], [9, 0, 0], [0, 0, 18])]
        if kind == "rectangle"
        else [triangle(*corners[:3]), triangle(corners[0], *corners[2:])]
    )
    above = lamp([-1, 2, -1], [2, 0, 0], [0, 0, 2])
    hits = traced(
        [floor, *screen],
        [[-0.5, 0.5, 0]],
        [[0.5, -0.5, 0]],
        lights=[above],
        points=4096,
        pattern=pattern,
        quality=quality,
    )
    tolerance = 4 * 0.5 / 64 if pattern == "random" else 0.0
    assert abs(hits.visibility[0, 0] - 0.5) <= tolerance


@BOTH
@PATTERNS
def test_a_light_in_the_plane_of_a_surface_gives_it_nothing(pattern: str, quality: Any) -> None:
    """The floor may lie anywhere, and its plane and the lamp's agree but for rounding."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        across, along, _ = turned(rng)
        center = rng.normal(size=3)
        floor = rectangle(center.tolist(), (4 * across).tolist(), (4 * along).tolist())
        beside = center - 3 * across + along
        lights = [
            lamp(beside.tolist(), across.tolist(), along.tolist(), visible=False),
            bulb((center - across).tolist()),
        ]
        document = scene(
            floor,
            sphere((center + 50 * across).tolist(), 1, material="black"),
            lights=lights,
            camera=camera(position=rng.normal(size=3).tolist(), look_at=(center + across + along).tolist()),
            ambient=[0, 0, 0],
            background=[0, 0, 0],
            materials={"plain": phong(specular=1, shininess=0), "black": phong([0, 0, 0])},
            sampling=sampled(1, 9, light=pattern),
        )
        assert not image_of(document, quality).any()


@BOTH
@PATTERNS
def test_a_lamp_in_its_ceiling_is_seen_whole(pattern: str, quality: Any) -> None:
    """The ceiling is a shape in the lamp's plane, turned so that the two agree but for rounding."""
    rng = np.random.default_rng(5)
    for offset in (0, 1e3, 1e6):
        across, along, up = turned(rng)
        center = rng.normal(size=3) * offset
        ceiling = rectangle(
            (center - 3 * across - 3 * along).tolist(), (6 * across).tolist(), (6 * along).tolist()
        )
        floor_corner = center - 4 * across - 4 * along - 2 * up
        floor = rectangle(floor_corner.tolist(), (8 * across).tolist(), (8 * along).tolist())
        light = lamp((center - across / 3 - along / 7).tolist(), across.tolist(), along.tolist())
        targets = floor_corner + rng.uniform(0, 8, (60, 1)) * across + rng.uniform(0, 8, (60, 1)) * along
        origins = np.broadcast_to(center - up, targets.shape)
        hits = traced(
            [ceiling, floor],
            origins,
            targets - origins,
            lights=[light],
            points=25,
            pattern=pattern,
            quality=quality,
        )
        assert (hits.shape == 1).all()
        assert (hits.visibility == 1).all()


@BOTH
def test_a_light_that_touches_the_floor_gives_finite_pixels(quality: Any) -> None:
    document = scene(
        rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0]),
        sphere([1, 0.5, 0], 0.5),
        lights=[lamp([-1, 0, 0], [2, 0, 0], [0, 2, 0], visible=False), bulb([0.25, 0, 1])],
        camera=camera(position=[0, 0.5, 1], look_at=[0, 0, 0]),
        materials={"plain": phong(specular=0.5, shininess=900)},
        sampling=sampled(4, 9),
    )
    image = image_of(document, quality)
    assert np.isfinite(image).all()
    assert image.max() < 10


@BOTH
def test_a_light_inside_a_ball_lights_nothing_outside_of_it(quality: Any) -> None:
    for place in ([0, 1, 0], [0.6, 1.5, 0.3], [0, 1.999, 0]):
        document = scene(
            rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0]),
            sphere([0, 1, 0], 1.0),
            lights=[bulb(place)],
            ambient=[0, 0, 0],
            background=[0, 0, 0],
        )
        assert not image_of(document, quality).any()


@BOTH
def test_no_light_comes_from_behind_the_true_surface(quality: Any) -> None:
    """However the normals at the vertices lean towards it."""
    leaning = [[1, 0.2, 0]] * 3
    document = scene(
        triangle([-2, 0, 2], [2, 0, 2], [0, 0, -3], normals=leaning),
        sphere([9, 0, 0], 1),
        lights=[
            bulb([5, -0.5, 0]),
            sun([-1, 0.1, 0]),
            lamp([4, -1, -1], [0, 0.9, 0], [0, 0, 2], visible=False),
        ],
        ambient=[0, 0, 0],
        background=[0, 0, 0],
        sampling=sampled(1, 9),
    )
    assert not image_of(document, quality)[:, :18].any()


@BOTH
@pytest.mark.parametrize("edge", ["tiles", "triangles"])
def test_a_place_under_the_seam_of_two_tiles_is_in_shadow(edge: str, quality: Any) -> None:
    """Whole numbers: the way to the light passes exactly through the edge that the two share."""
    floor = rectangle([-8, 0, -8], [0, 0, 16], [16, 0, 0])
    tiles = [rectangle([-4, 2, -4], [4, 0, 0], [0, 0, 8]), rectangle([0, 2, -4], [4, 0, 0], [0, 0, 8])]
    halves = [triangle([-4, 2, -4], [4, 2, -4], [4, 2, 4]), triangle([-4, 2, -4], [4, 2, 4], [-4, 2, 4])]
    places = [[0, 0, z] for z in range(-3, 4)] if edge == "tiles" else [[z, 0, z] for z in range(-3, 4)]
    origins = [[x + 0.25, 1, z] for x, _, z in places]
    directions = np.array(places) - origins
    hits = traced(
        [floor, *(tiles if edge == "tiles" else halves)],
        origins,
        directions,
        lights=[sun([0, -1, 0]), bulb([0, 4, 0])],
        quality=quality,
    )
    assert (hits.shape == 0).all()
    assert (hits.visibility == 0).all()
