"""Lamps that the camera sees, far brighter than white and no larger than a few pixels.

Lamps and the plates before them have sides along those of the picture, so that what each covers of a pixel is
a product of two lengths: what the picture must show follows without a renderer.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

import renderer
from renderer.math.arrays import Floats
from schemas.quality import TargetQuality
from tests.documents import Json, camera, lamp, phong, rectangle, scene

SIDE, FAR, NEAR = 24, 12.0, 9.0
"""Pixels of a side, and the distances of lamps and of plates: at the first a pixel is half a unit wide."""

ERROR = 1 / 255
SEEDS = range(8)
MISSED = 2
"""Of eight targets that are each kept with 95 in 100, three or more are missed once in 170 runs."""

WALL, PLATE = (0.2, 0.3, 0.4), (0.5, 0.4, 0.1)


@dataclass(frozen=True)
class Box:
    """Left, top, right and bottom on the picture, pixels; and a colour."""

    ends: Floats
    color: Floats

    def shares(self, other: "Box | None" = None) -> Floats:
        """Share of each pixel that it covers, (SIDE, SIDE), alone or in common with another."""
        low, high = self.ends[:2], self.ends[2:]
        if other:
            low, high = np.maximum(low, other.ends[:2]), np.minimum(high, other.ends[2:])
        first = np.arange(SIDE)
        across, along = (
            np.clip(np.minimum(high[axis], first + 1) - np.maximum(low[axis], first), 0, 1) for axis in (0, 1)
        )
        return np.outer(along, across)

    def edges(self, distance: float) -> tuple[list[float], list[float], list[float]]:
        """Corner and edges in the scene, `distance` before the camera."""
        unit = distance / FAR / 2
        left, top, right, bottom = (self.ends - SIDE / 2) * unit
        return [left, -bottom, FAR - distance], [right - left, 0, 0], [0, bottom - top, 0]


def boxes(seed: int, brightness: float, size: float) -> tuple[list[Box], list[Box]]:
    """A lamp in each quarter of the picture, and plates that hide some of three of them."""
    chosen = np.random.default_rng(seed)
    lamps, plates = [], []
    for corner in ((0, 0), (0, 12), (12, 0), (12, 12)):
        start = chosen.uniform(3, 6, 2) + corner
        sides = size * chosen.uniform(0.3, 2, 2)
        lamps.append(Box(np.hstack((start, start + sides)), brightness * chosen.uniform(0.5, 1, 3)))
        edge = start + sides * chosen.uniform(0.1, 0.9, 2)
        plates.append(Box(np.hstack((edge, edge + chosen.uniform(1, 3, 2))), np.array(PLATE)))
    return lamps, plates[:3]


def document(seed: int, lamps: list[Box], plates: list[Box]) -> Json:
    """The scene of these boxes before a wall."""
    view = camera(position=[0, 0, FAR], look_at=[0, 0, 0], width=SIDE, height=SIDE)
    view["vertical_fov"] = float(2 * np.degrees(np.arctan(SIDE / 4 / FAR)))
    matt = {"ambient": 1, "diffuse": 0}
    return scene(
        rectangle([-20, -20, -2], [40, 0, 0], [0, 40, 0]),
        *(rectangle(*plate.edges(NEAR), material="plate") for plate in plates),
        ambient=[1, 1, 1],
        materials={"plain": phong(WALL, **matt), "plate": phong(PLATE, **matt)},
        camera=view,
        lights=[lamp(*each.edges(FAR), color=each.color, visible=True) for each in lamps],
        sampling={"seed": seed},
    )


def shown(lamps: list[Box], plates: list[Box]) -> Floats:
    """Exact picture, clipped to 0..1."""
    rest, found = np.ones((SIDE, SIDE)), np.zeros((SIDE, SIDE, 3))
    for plate in plates:
        rest -= plate.shares()
        found += plate.shares()[:, :, None] * plate.color
    for each in lamps:
        share = each.shares() - sum(each.shares(plate) for plate in plates)
        rest -= share
        found += share[:, :, None] * each.color
    return np.clip(found + rest[:, :, None] * np.array(WALL), 0, 1)


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    "hidden", [pytest.param(False, id="open", marks=SLOW), pytest.param(True, id="hidden")]
)
@pytest.mark.parametrize(
    ("brightness", "size"),
    [pytest.param(157, 0.1, marks=SLOW), pytest.param(15700, 0.1, marks=SLOW), (1570, 1.5)],
)
def test_small_bright_lamps_keep_the_target(brightness: float, size: float, hidden: bool) -> None:
    missed, outside = 0, 0
    for seed in SEEDS:
        lamps, plates = boxes(seed, brightness, size)
        plates = plates if hidden else []
        plan = renderer.compile_scene(
            document(seed, lamps, plates), TargetQuality(mode="target", error=ERROR)
        )
        result = renderer.render(plan)
        true = float(np.sqrt(np.mean((np.clip(result.image, 0, 1) - shown(lamps, plates)) ** 2)))
        error = result.report["error"]
        missed += true > 1.25 * ERROR
        outside += not error["low"] - 1e-6 <= true <= error["high"] + 1e-6
    assert missed <= MISSED
    assert outside <= MISSED


def mirrored(seed: int, lamps: list[Box]) -> Json:
    """The same picture of lamps behind the camera, in a mirror before it; the wall's colour is all around."""
    plane = 2 * FAR / 3
    behind = [([x, y, 2 * plane], *sides) for (x, y, _), *sides in (each.edges(FAR) for each in lamps)]
    return document(seed, lamps, []) | {
        "background": list(WALL),
        "shapes": [rectangle([-20, -20, plane], [40, 0, 0], [0, 40, 0])],
        "materials": {"plain": phong([0, 0, 0], ambient=0, diffuse=0, mirror=1.0)},
        "lights": [
            lamp(*place, color=each.color, visible=True) for place, each in zip(behind, lamps, strict=True)
        ],
    }


@cache
def in_mirror(seed: int, brightness: float, size: float) -> tuple[float, dict[str, float]]:
    """The true error of a picture of lamps in a mirror, and the reported one."""
    lamps, _ = boxes(seed, brightness, size)
    plan = renderer.compile_scene(mirrored(seed, lamps), TargetQuality(mode="target", error=ERROR))
    result = renderer.render(plan)
    true = float(np.sqrt(np.mean((np.clip(result.image, 0, 1) - shown(lamps, [])) ** 2)))
    return true, result.report["error"]


CASES = [(157, 0.1), (157, 0.4), (1570, 0.1), (15700, 0.1)]


@SLOW
@pytest.mark.parametrize(("brightness", "size"), CASES)
def test_mirrored_lamps_are_in_the_interval(brightness: float, size: float) -> None:
    for true, error in (in_mirror(seed, brightness, size) for seed in SEEDS):
        assert true <= error["high"]


@pytest.mark.xfail(reason="no ray looks for reflections: only the interval says that they may be there")
@SLOW
@pytest.mark.parametrize(("brightness", "size"), CASES)
def test_mirrored_lamps_keep_the_target(brightness: float, size: float) -> None:
    missed = sum(in_mirror(seed, brightness, size)[0] > 1.25 * ERROR for seed in SEEDS)
    assert missed <= MISSED
