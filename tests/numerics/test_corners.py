"""Corner lines of rooms and wedges: what mirrors show there, and what light passes there."""

import itertools
import math
from collections import Counter
from typing import Any

import numpy as np
import pytest

from renderer.integrator import radiance
from tests.documents import bulb, lamp, phong, scene
from tests.numerics.places import (
    FLOORS,
    PATTERNS,
    SCALES,
    Place,
    View,
    places,
    rising,
    room,
    seen_in_room,
)
from tests.numerics.tracing import QUALITIES, rays_of
from tests.pictures.parts import DOUBLE, plan_of

KINDS = pytest.mark.parametrize("kind", FLOORS)
MIRRORS = pytest.mark.parametrize("mirrors", [(), (0,), (0, 1, 2)], ids=["no mirror", "one", "three"])


def rooms(name: str) -> Any:
    """Turned and upright places of all sizes, near and far, with numbers to draw from."""
    for chosen, place in places(name, offsets=(0.0, 1e7), scales=SCALES[::4]):
        yield chosen, place
        # Along the axes, where planes and edges are exact.
        yield chosen, Place(place.center, np.eye(3), place.unit)


@KINDS
@MIRRORS
def test_corner_of_a_lit_room_is_never_dark(mirrors: tuple[int, ...], kind: str) -> None:
    """A room is convex: its lights reach every wall, and a path of at most four bounces ends at one."""
    for number, (chosen, place) in enumerate(rooms("mirrors")):
        shapes, quality = room(kind, place, mirrors), QUALITIES[number % 2]
        assert (seen_in_room(shapes, place, chosen, quality, PATTERNS[number % 4]) > 0).all()


@KINDS
@pytest.mark.parametrize("degrees", [10, 2, 0.5])
def test_wedge_of_mirrors_lets_no_path_out_at_its_edge(kind: str, degrees: float) -> None:
    """Unfolded the path is straight: it leaves after 180 degrees of walls, 18 at least, and may pass 10."""
    angle = math.radians(degrees)
    mirror = phong([0, 0, 0], ambient=0, diffuse=0, mirror=1, max_depth=10)
    for chosen, place in places(f"wedge {kind}", offsets=(0.0, 1e3, 1e6)):
        walls = [*rising(kind, place, 0.0), *rising(kind, place, angle)]
        white = {"background": [1, 1, 1], "ambient": [0, 0, 0], "materials": {"plain": mirror}}
        foot = place.at(10.0 ** chosen.uniform(-17, -14, 40), 0, chosen.uniform(-3, 3, 40))
        eye = place.at(3 * math.cos(0.4 * angle), 3 * math.sin(0.4 * angle), 0.3)
        rays = rays_of(eye[:, None], (foot - eye).T)
        assert not radiance(plan_of(scene(*walls, **white), DOUBLE), rays, Counter()).any()


@KINDS
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
