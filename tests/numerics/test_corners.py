"""Corner lines of rooms: what mirrors show there, and what light passes there."""

import math

import numpy as np
import pytest

from renderer.hard_cases.documents import Json, bulb, lamp, rectangle
from renderer.hard_cases.shadow_rooms import SHARES, WALLS, inner_lights, outer_lights, room, seen_in_room
from renderer.hard_cases.shadow_scenes import PATTERNS, SCALES, Place, grid, places, triangulated
from tests.images.parts import DOUBLE, SINGLE
from tests.numerics.tracing import towards, traced

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


def slope(kind: str, place: Place, angle: float) -> list[Json]:
    """A wall six units wide that rises at an angle from a line of eight units."""
    corner, along = place.at(0, 0, -4), place.way(0, 0, 8)
    up = place.way(6 * math.cos(angle), 6 * math.sin(angle), 0)
    if kind == "tiles":
        return [rectangle(corner.tolist(), along.tolist(), up.tolist())]
    steps = np.linspace(0, 1, SHARES[kind] + 1)
    u, v = (part.ravel() for part in np.meshgrid(steps, steps, indexing="ij"))
    _, faces = grid(place, steps, 0.0)
    return triangulated(kind, corner + np.outer(u, along) + np.outer(v, up), faces)


@BOTH
@KINDS
@pytest.mark.parametrize("degrees", [90, 50, 20, 1])
def test_no_light_passes_the_line_where_three_walls_meet_at_sharp_angles(
    kind: str, degrees: float, quality: object
) -> None:
    """The foot of the middle wall, seen from between the others. Lights are behind these, flat to both."""
    for number, (chosen, place) in enumerate(places("sharp", offsets=(0.0, 1e3, 1e7), scales=SCALES[::2])):
        angle = math.radians(degrees)
        walls = [wall for share in (0, 1, 0.45) for wall in slope(kind, place, share * angle)]
        away = math.pi + angle / 2
        behind = (5 * math.cos(away), 5 * math.sin(away), 0.3)
        edges = place.way(0, 0, 0.8), place.way(-0.3 * math.sin(away), 0.3 * math.cos(away), 0)
        lights = [bulb(place.at(*behind).tolist())]
        lights += [lamp(lights[0]["position"], *(edge.tolist() for edge in edges), two_sided=True)]
        foot = place.at(10.0 ** chosen.uniform(-17, -14, 40), 0, chosen.uniform(-3, 3, 40))
        within = angle * (0.2, 0.8)[number % 2]
        eye = place.at(2.5 * math.cos(within), 2.5 * math.sin(within), 0.2)
        hits = traced(
            walls,
            *towards(eye.tolist(), foot),
            lights=lights,
            points=9,
            pattern=PATTERNS[number % 4],
            quality=quality,  # type: ignore[arg-type]
        )
        assert (hits.shape >= 0).all()
        assert not hits.visibility.any()
