"""Hard cases: rooms of mirrors, where paths run along corners and end after so many bounces."""

import itertools
from collections.abc import Sequence

import numpy as np

from accuracy.hard_cases.cases import Outcome, Section, total
from accuracy.hard_cases.plain_shadows import STEP
from accuracy.hard_cases.shadow_rooms import (
    EYE,
    WALLS,
    corner_targets,
    inner_lights,
    room,
    seen_in_room,
)
from accuracy.hard_cases.shadow_scenes import PATTERNS, PRECISIONS, Place, places
from renderer.math.arrays import Floats, Integers, Masks, Pairs

SECTION = Section("Rooms of mirrors")

DEPTHS = (3, 8, 32)
AXES = ((0,), (0, 2))
"""Axes that a pair of mirrors is across: one pair, and two of them."""

ACROSS = (2, 0, 1)
"""Axis that the walls of a room are across, in their order."""

DTYPES: tuple[type[np.floating], ...] = (np.float64, np.float32)


@SECTION.case(
    "corners of facing mirrors",
    symptom="Dark dots along the lines where mirrors meet, among the places that are dark for a reason: "
    "their paths come to the last bounce.",
    cause="In a corner the way from one mirror to the next is shorter than rounding. What steps over a "
    "length leaves the room there.",
    remedy="No ray is moved: it knows the surface that it leaves, and on which side of the walls its path "
    "came there.",
    expected="At the corner lines a path is dark exactly where it needs more bounces than allowed. How many, "
    "the straight way through rooms mirrored at their walls says.",
    source="geometry",
)
def facing_corners() -> Outcome:
    """Rooms with one or two pairs of facing mirrors; the other walls are lit by lights in the room."""
    outcomes = []
    upright = Place(np.zeros(3), np.eye(3), 1.0)
    for number, (axes, kind) in enumerate(itertools.product(AXES, WALLS)):
        depth, seed = DEPTHS[number % 3], [number, 4]
        ways = corner_targets(np.random.default_rng(seed), 6) - EYE
        dark = bounces(ways, axes) > depth
        plain = [int(np.count_nonzero(plainly_dark(ways, axes, depth, dtype) != dark)) for dtype in DTYPES]
        turned = (place for _, place in places(f"mirrors {kind}", offsets=(1e7,)))
        for place in itertools.chain(turned, [upright]):
            light = seen_in_room(
                room(kind, place, [wall for wall in range(6) if ACROSS[wall % 3] in axes]),
                place,
                np.random.default_rng(seed),
                PRECISIONS[number % 2],
                shining=inner_lights(place),
                pattern=PATTERNS[number % 4],
                depth=depth,
            )
            outcomes.append(Outcome(dark.size, int(np.count_nonzero((light == 0) != dark)), *plain))
    return total(outcomes)


def bounces(ways: Floats, axes: Sequence[int]) -> Floats:
    """Mirrors across some axes that are met on ways (N, 3) from the eye before another wall, (N,).

    By the straight way: the mirror images of a room two units wide have walls at all odd numbers.
    """
    others = [axis for axis in range(3) if axis not in axes]
    with np.errstate(divide="ignore"):
        ends = [(1 - np.sign(ways[:, axis]) * EYE[axis]) / np.abs(ways[:, axis]) for axis in others]
    end = np.minimum.reduce(ends)
    return np.sum([np.floor((np.abs(EYE[axis] + ways[:, axis] * end) + 1) / 2) for axis in axes], axis=0)


def plainly_dark(ways: Floats, axes: Sequence[int], depth: int, dtype: type[np.floating]) -> Masks:
    """Ways (N, 3) on which a textbook that steps over what is near meets no wall but mirrors."""
    along = ways.astype(dtype)
    at = np.broadcast_to(EYE.astype(dtype), along.shape).copy()
    lit = np.zeros(len(along), dtype=bool)
    for _ in range(depth + 1):
        wall, t = _next_wall(at, along)
        inside = np.isfinite(t)
        lit |= inside & ~np.isin(wall, axes)
        at += np.where(inside, t, 0)[:, None] * along
        along = along * np.where(np.arange(3) == wall[:, None], -1, 1).astype(dtype)
        # What is lit or has left the room goes nowhere any more.
        along[lit | ~inside] = np.nan
    return ~lit


def _next_wall(at: Pairs, along: Pairs) -> tuple[Integers, Pairs]:
    """Axis that the next wall of the room is across (N,), and the way there (N,); inf for none."""
    nearest, wall = np.full(len(at), np.inf, dtype=at.dtype), np.zeros(len(at), dtype=np.int64)
    with np.errstate(all="ignore"):
        for axis, side in itertools.product(range(3), (-1, 1)):
            t = (side - at[:, axis]) / along[:, axis]
            places = np.delete(at + t[:, None] * along, axis, axis=1)
            met = (t > STEP) & (np.abs(places) <= 1).all(axis=1) & (t < nearest)
            nearest, wall = np.where(met, t, nearest), np.where(met, axis, wall)
    return wall, nearest
