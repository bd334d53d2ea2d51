"""Whether what a quote predicts is what rendering then takes."""

from __future__ import annotations

import statistics
from typing import TYPE_CHECKING, TypedDict

import renderer
from accuracy.quotes import quote
from accuracy.variations import label
from benchmarks.machine import render_seconds
from benchmarks.references import SCENES
from schemas.quality import FixedQuality

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from schemas.api.plans import Offer
    from schemas.quality import Quality

PATHS = tuple(sorted((SCENES.parent / "gallery").glob("*.json")))

COUNTS = (1, 4)
"""Camera samples of the offers that are rendered, beside the scene's own; the others take
minutes."""

NEAR = 0.25
"""A prediction is near if what was measured is off by no more than this part of it."""


class Prediction(TypedDict):
    """A scene at a quality: CPU seconds that were predicted, with their interval, and those that it took."""

    scene: str
    quality: str
    mode: str
    predicted: float
    low: float
    high: float
    measured: float


class QuoteSummary(TypedDict):
    """How many predictions there are, and the shares, 0 to 1, that are near and whose interval holds."""

    predictions: int
    near: float
    held: float
    median_ratio: float


class Quotes(TypedDict):
    """All predictions, what they come to by mode, and the longest pilot, seconds."""

    predictions: list[Prediction]
    fixed: QuoteSummary
    target: QuoteSummary
    longest_pilot: float


def measure(paths: Iterable[Path] = PATHS) -> Quotes:
    """Quote every scene, and at once render what was quoted, in one process."""
    predictions, pilots = [], []
    for path in paths:
        scene = renderer.load_scene(path)
        found = quote(scene)
        pilots.append(found.pilot.seconds)
        asked = found.asked.quality if found.asked else None
        predictions += [_measured(path.stem, scene, offer) for offer in _rendered(found.offers, asked)]
    by_mode = {mode: [each for each in predictions if each["mode"] == mode] for mode in ("fixed", "target")}
    return Quotes(
        predictions=predictions,
        fixed=summary(by_mode["fixed"]),
        target=summary(by_mode["target"]),
        longest_pilot=round(max(pilots), 2),
    )


def summary(predictions: list[Prediction]) -> QuoteSummary:
    """What predictions come to."""
    ratios = [each["measured"] / each["predicted"] for each in predictions]
    return QuoteSummary(
        predictions=len(predictions),
        near=_share([abs(ratio - 1) <= NEAR for ratio in ratios]),
        held=_share([each["low"] <= each["measured"] <= each["high"] for each in predictions]),
        median_ratio=round(statistics.median(ratios), 3) if ratios else 0.0,
    )


def _share(yes: list[bool]) -> float:
    return round(sum(yes) / len(yes), 3) if yes else 0.0


def _rendered(offers: Iterable[Offer], asked: Quality | None) -> Iterator[Offer]:
    for offer in offers:
        quality = offer.quality
        fixed = quality.antialiasing if isinstance(quality, FixedQuality) else None
        if fixed is None or fixed.samples in COUNTS or quality == asked:
            yield offer


def _measured(name: str, scene: renderer.LoadedScene, offer: Offer) -> Prediction:
    plan = renderer.compile_scene(scene, offer.quality)
    measured = render_seconds(plan)
    predicted = offer.cpu_seconds
    return Prediction(
        scene=name,
        quality=label(offer.quality),
        mode=offer.quality.mode,
        predicted=round(predicted.estimate, 3),
        low=round(predicted.low, 3),
        high=round(predicted.high, 3),
        measured=round(measured, 3),
    )
