"""Corner lines of rooms: what mirrors show there, and what light passes there."""

import math
from collections import Counter

import numpy as np
import pytest

from accuracy.hard_cases.documents import phong, scene
from accuracy.hard_cases.shadows.occluders import rising
from accuracy.hard_cases.shadows.scenes import (
    PATTERNS,
    SCALES,
    WALLS,
    Place,
    inner_lights,
    outer_lights,
    places,
    room,
    seen_in_room,
)
from renderer.integrator import radiance
from renderer.interaction import Rays
from tests.pictures.parts import DOUBLE, SINGLE, plan_of

BOTH = pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])
KINDS = pytest.mark.parametrize("kind", WALLS)


def upright(place: Place) -> Place:
    """Along the axes, where planes and edges are exact."""
    return Place(place.center, np.eye(3), place.unit)


@BOTH
@KINDS
@pytest.mark.parametrize("mirrors", [(), (0,), (0, 1), (0, 1, 2)], ids=["none", "one", "two", "three"])
def test_no_place_in_a_room_is_dark_seen_in_mirrors_that_meet_at_its_corners(
    mirrors: tuple[int, ...], kind: str, quality: object
) -> None:
    """A room is convex: its lights reach every wall, and a path of at most four bounces ends at one."""
    for number, (chosen, place) in enumerate(places("mirrors", offsets=(0.0, 1e3, 1e7), scales=SCALES[::2])):
        for where in (place, upright(place)):
            pattern = PATTERNS[number % 4]
            light = seen_in_room(
                room(kind, where, mirrors),
                where,
                chosen,
                quality,  # type: ignore[arg-type]
                shining=inner_lights(where),
                pattern=pattern,
            )
            assert (light > 0).all()


@BOTH
@KINDS
@pytest.mark.parametrize("mirrors", [(), (0,), (0, 1, 2)], ids=["none", "one", "three"])
def test_no_light_from_outside_is_seen_at_the_corners_of_a_room_nor_in_mirrors_there(
    mirrors: tuple[int, ...], kind: str, quality: object
) -> None:
    for number, (chosen, place) in enumerate(places("leaks", offsets=(0.0, 1e3, 1e7), scales=SCALES[::2])):
        for where in (place, upright(place)):
            light = seen_in_room(
                room(kind, where, mirrors),
                where,
                chosen,
                quality,  # type: ignore[arg-type]
                shining=outer_lights(where),
                pattern=PATTERNS[number % 4],
            )
            assert not light.any()


@KINDS
@pytest.mark.parametrize("degrees", [10, 2, 0.5])
def test_no_path_leaves_a_wedge_of_mirrors_at_its_edge(kind: str, degrees: float) -> None:
    """Unfolded the path is straight: it leaves after 180 degrees of walls, 18 at least, and may pass 10."""
    angle = math.radians(degrees)
    mirror = phong([0, 0, 0], ambient=0, diffuse=0, mirror=1, max_depth=10)
    for chosen, place in places(f"wedge {kind}", offsets=(0.0, 1e3, 1e6)):
        walls = [*rising(kind, place, 0.0), *rising(kind, place, angle)]
        white = {"background": [1, 1, 1], "ambient": [0, 0, 0], "materials": {"plain": mirror}}
        foot = place.at(10.0 ** chosen.uniform(-17, -14, 40), 0, chosen.uniform(-3, 3, 40))
        eye = place.at(3 * math.cos(0.4 * angle), 3 * math.sin(0.4 * angle), 0.3)
        numbers = np.arange(len(foot))
        rays = Rays(eye[:, None], np.ascontiguousarray((foot - eye).T), numbers, np.zeros_like(numbers))
        assert not radiance(plan_of(scene(*walls, **white), DOUBLE), rays, Counter()).any()
