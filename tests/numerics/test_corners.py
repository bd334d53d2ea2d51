"""Corner lines of rooms: what mirrors show there, and what light passes there."""

import numpy as np
import pytest

from renderer.hard_cases.shadow_rooms import WALLS, inner_lights, outer_lights, room, seen_in_room
from renderer.hard_cases.shadow_scenes import PATTERNS, SCALES, Place, places
from tests.images.parts import DOUBLE, SINGLE

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
