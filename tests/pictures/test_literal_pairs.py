"""Every kind of shape in the way of every kind, as `literal` draws it and as the renderer does."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import renderer
from renderer.plan.building import compile_visibility
from schemas.reading import read_scene
from schemas.scene import Scene
from tests.pictures.literal import Codes, Drawing
from tests.pictures.literal_surfaces import V, add, edges, mul, sub
from tests.pictures.paired_scenes import FILES, PAIRS, paired_scene
from tests.pictures.parts import DOUBLE, SINGLE, Files, png, samples_of

CODES: dict[str, Codes] = {name: codes.tolist() for name, codes in FILES.items()}
PNGS = {name: png(codes) for name, codes in FILES.items()}

BOUNDS = {"double": (DOUBLE, 1e-9, 1e-9), "single": (SINGLE, 12 * 30 * 2.0**-24, 2.0**-17)}
"""Most that rounding may change a sample by, and move a border by, scene units.

Up to five bounces magnify the rounding of float64. Pair work in float32 takes a dozen roundings of 2**-24 to
the power 30, and moves the edge of what is within 16 units by less than 16 * 2**-21.
"""


class Scattered(Drawing):
    """A drawing with the light points that a plan draws for the camera's rays."""

    def __init__(self, plan: renderer.RenderPlan, scene: Scene, **options: float) -> None:
        super().__init__(scene, CODES, **options)
        self.emitters = [lighting.emitter for lighting in compile_visibility(plan)]

    def light_points(self, light: Any, place: V) -> Iterator[tuple[V, float]]:
        if light.type != "rectangle":
            yield from super().light_points(light, place)
            return
        emitter = self.emitters[self.scene.lights.index(light)]
        pixel, sample = (np.array([number]) for number in self.sample)
        drawn = emitter.points(pixel, sample, np.zeros(1, np.uint64), np.dtype(np.float64))
        corner, first, second = edges(light)
        for u, v in zip(*(part.ravel().tolist() for part in drawn.places(np.arange(1))), strict=True):
            yield sub(add(corner, add(mul(first, u + 0.5), mul(second, v + 0.5))), place), 1.0


@dataclass(frozen=True)
class Compared:
    """Numbers of samples that differ in a precision, and of those next to a border."""

    precision: str
    different: int
    explained: int


def compared(seed: int, *, few: bool = False) -> list[Compared]:
    """Comparison of a scene in both precisions; `few` limits its triangles to the visible ones.

    A sample lies next to a border if its drawing changes when all shapes are larger or smaller by what
    rounding may move a border by, or horizons higher or lower.
    """
    pair = paired_scene(seed)
    scene = read_scene(pair.plain)[0]
    shared = pair.plain["sampling"]["light"]["pattern"] == "uniform"
    loaded = renderer.load_scene(pair.plain if few else pair.rendered, assets=Files(PNGS))
    plans = {name: renderer.compile_scene(loaded, quality) for name, (quality, *_) in BOUNDS.items()}

    def drawing(margin: float = 0.0, horizon: float = 0.0) -> Drawing:
        options = {"margin": margin, "horizon": horizon}
        return Drawing(scene, CODES, **options) if shared else Scattered(plans["double"], scene, **options)

    expected = np.array(drawing().samples())
    found = []
    for name, (_, bound, room) in BOUNDS.items():
        # Light that falls with the distance is much more than 1 near a lamp.
        allowed = bound * np.maximum(1.0, expected)
        wrong = (np.abs(samples_of(plans[name]) - expected) > allowed).any(axis=3)
        explained = np.zeros_like(wrong)
        for row, column in np.argwhere(wrong.any(axis=2)):
            for margin, horizon in itertools.product((-room, room), repeat=2):
                other = np.array(drawing(margin, horizon).pixel(column, row))
                explained[row, column] |= (np.abs(other - expected[row, column]) > allowed[row, column]).any(
                    axis=1
                )
        found.append(Compared(name, int(wrong.sum()), int((wrong & explained).sum())))
    return found


@pytest.mark.parametrize("seed", range(30))
def test_pairs_of_kinds_against_the_tracer(seed: int) -> None:
    for each in compared(seed):
        assert each.different == each.explained, each


@pytest.mark.slow
@pytest.mark.parametrize("first", range(30, len(PAIRS), 70))
def test_all_pairs_against_the_tracer(first: int) -> None:
    for seed in range(first, min(first + 70, len(PAIRS))):
        for each in compared(seed):
            assert each.different == each.explained, (seed, each)
