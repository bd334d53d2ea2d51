"""What stability costs in time, and what it buys: Penumbra's formulas beside the textbooks' in float32."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, TypedDict

import numpy as np

import renderer
from accuracy.hard_cases.scene_values.scenes import placed
from accuracy.statistics import clipped
from benchmarks import kernels
from benchmarks.machine import render_seconds
from benchmarks.references import PATHS
from benchmarks.settings import Setting
from benchmarks.textbook.plans import factored, textbook

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from renderer.plan.plan import RenderPlan

WAYS: dict[str, Callable[[RenderPlan], RenderPlan]] = {
    "penumbra": lambda plan: plan,
    "textbook": textbook,
    "factored": factored,
}
"""Plans of the same picture. `factored` is the textbook with the pair work of shadows and Phong as here."""

PRICED = tuple(
    Setting(scene, "uniform", samples, "uniform", light_samples)
    for scene in ("soft", "chess")
    for samples, light_samples in ((1, 64), (4, 16))
)
"""What the price is judged by."""

COMPARED = tuple(setting for setting in PRICED if setting.samples == 1)
"""What is compared for errors."""

OFFSETS = (0.0, 1e3, 1e4, 1e5)
"""How far a scene is moved along (1, -1, 1), scene units."""

ASIDE = (0.0123, 0.0087, 0.0)
"""How far the camera is moved, scene units. Where it stands, rays hit the very edges of the room, and either
side of them is right."""


class Price(TypedDict):
    """CPU seconds of a kernel or a picture by way, the fastest of several rounds; 0 for a way without it."""

    name: str
    seconds: dict[str, float]


class Prices(TypedDict):
    """Of the kernels in one picture each, and of whole pictures."""

    kernels: list[Price]
    pictures: list[Price]


class PictureErrors(TypedDict):
    """Shares of the pixels by way, 0 to 1: off by more than 1/255, and darker by as much."""

    scene: str
    offset: float
    off: dict[str, float]
    dark: dict[str, float]


class Stability(TypedDict):
    """The cost, and what it buys."""

    prices: Prices
    errors: list[PictureErrors]


def measure(runs: int) -> Stability:
    """Time all ways in turns, `runs` rounds after one that warms caches up; compare their pictures once."""
    # The textbooks divide by zero where a ray is parallel to a plane.
    with np.errstate(all="ignore"):
        prices = Prices(kernels=_of_kernels(runs), pictures=[_price(each, runs) for each in PRICED])
        errors = [_errors(setting, offset) for setting in COMPARED for offset in OFFSETS]
    return Stability(prices=prices, errors=errors)


def _of_kernels(runs: int) -> list[Price]:
    prices: dict[str, Price] = {}
    for plan in (PRICED[0].plan(), kernels.of_many_triangles()):
        clocks = _in_turns(plan, kernels.seconds_of, runs)
        for name in clocks["penumbra"][0]:
            seconds = {way: min(clock.get(name, 0.0) for clock in rounds) for way, rounds in clocks.items()}
            prices.setdefault(name, Price(name=name, seconds=_rounded(seconds)))
    return [*prices.values()]


def _price(setting: Setting, runs: int) -> Price:
    clocks = _in_turns(setting.plan(), render_seconds, runs)
    return Price(name=setting.name, seconds=_rounded({way: min(rounds) for way, rounds in clocks.items()}))


def _in_turns(plan: RenderPlan, measured: Callable[[RenderPlan], Any], runs: int) -> dict[str, list[Any]]:
    """What is measured of each way in each round but the first, which warms caches up."""
    plans = {way: replaced(plan) for way, replaced in WAYS.items()}
    rounds = [{way: measured(each) for way, each in plans.items()} for _ in range(runs + 1)]
    return {way: [done[way] for done in rounds[1:]] for way in plans}


def _rounded(seconds: dict[str, float]) -> dict[str, float]:
    return {way: round(value, 5) for way, value in seconds.items()}


def _errors(setting: Setting, offset: float) -> PictureErrors:
    """Against Penumbra's picture of the scene where it is written, with pair work in float64 too."""
    exact = setting.quality.model_copy(update={"precision": "double"})
    expected = _levels(renderer.compile_scene(_scene(setting, 0.0), exact))
    plan = renderer.compile_scene(_scene(setting, offset), setting.quality)
    differences = {way: _levels(replaced(plan)) - expected for way, replaced in WAYS.items()}
    return PictureErrors(
        scene=setting.scene,
        offset=offset,
        off={way: _share(np.abs(levels).max(axis=2)) for way, levels in differences.items()},
        dark={way: _share(-levels.min(axis=2)) for way, levels in differences.items()},
    )


def _scene(setting: Setting, offset: float) -> dict[str, Any]:
    document = json.loads(PATHS[setting.scene].read_text())
    for name in ("position", "look_at"):
        moved = zip(document["camera"][name], ASIDE, strict=True)
        document["camera"][name] = [value + aside for value, aside in moved]
    return placed(document, offset=offset)


def _levels(plan: RenderPlan) -> NDArray[np.float64]:
    """Linear values clipped to 0..1 in units of 1/255; what is not a number counts as black."""
    image = np.nan_to_num(renderer.render(plan).image)
    return 255 * clipped(image)


def _share(levels: NDArray[np.float64]) -> float:
    return round(float(np.mean(levels > 1)), 6)
