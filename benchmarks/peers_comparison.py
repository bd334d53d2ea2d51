"""What the runs come to: CPU seconds at equal error, what you get when you ask, and how exact that is."""

from __future__ import annotations

import statistics
from typing import TYPE_CHECKING, TypedDict

from benchmarks.peers_curves import runs_by, seconds_at
from benchmarks.peers_runs import OURS, OURS_FIXED, PEER, RENDERERS
from benchmarks.peers_settings import ERRORS_255, GOALS, SCENES

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from benchmarks.peers_runs import Run

FLOOR = 1.1
"""CPU seconds over those of the cheapest target up to which a picture cost what any picture does. There was
nothing left to save, so its error may be far below the target."""


class Asked(TypedDict):
    """What a user gets for a target error; `over_peer` compares with Mitsuba at exactly that error."""

    cpu_seconds: float
    rmse_255: float
    over_peer: float | None


class Comparison(TypedDict):
    """A scene at a true error: CPU seconds by renderer, None where it is not reached, and their ratios.

    `over_peer` is ours over Mitsuba's, `over_fixed` target quality's over those of the best fixed samples.
    """

    scene: str
    kind: str
    error_255: float
    seconds: dict[str, float | None]
    over_peer: float | None
    goal: float | None
    over_fixed: float | None
    asked: Asked | None


class Precision(TypedDict):
    """True error over the target error, of a scene's targets that needed samples, and how many kept it."""

    scene: str
    targets: int
    kept: int
    least: float
    median: float
    most: float


def comparisons(scenes: Mapping[str, Sequence[Run]], errors_255: Iterable[float]) -> list[Comparison]:
    """Compare renderers in every scene at every error."""
    errors = list(errors_255)
    return [_comparison(scene, runs, error) for scene, runs in scenes.items() for error in errors]


def _comparison(scene: str, runs: Sequence[Run], error_255: float) -> Comparison:
    seconds = {name: seconds_at(runs_by(name, runs), error_255) for name in RENDERERS}
    kind = SCENES[scene]
    return Comparison(
        scene=scene,
        kind=kind,
        error_255=error_255,
        seconds={name: _rounded(value) for name, value in seconds.items()},
        over_peer=_rounded(_ratio(seconds[OURS], seconds[PEER])),
        goal=dict(zip(ERRORS_255, GOALS[kind], strict=True)).get(error_255),
        over_fixed=_rounded(_ratio(seconds[OURS], seconds[OURS_FIXED])),
        asked=_asked(runs, error_255, seconds[PEER]),
    )


def _asked(runs: Sequence[Run], error_255: float, peer_seconds: float | None) -> Asked | None:
    for run in runs:
        if run["asked_255"] == error_255:
            ratio = _ratio(run["cpu_seconds"], peer_seconds)
            return Asked(cpu_seconds=run["cpu_seconds"], rmse_255=run["rmse_255"], over_peer=_rounded(ratio))
    return None


def precisions(scenes: Mapping[str, Sequence[Run]]) -> list[Precision]:
    """How near true errors are to their targets, in scenes where any target needed samples."""
    found = ((scene, needed_samples(runs)) for scene, runs in scenes.items())
    return [_precision(scene, runs) for scene, runs in found if runs]


def needed_samples(runs: Iterable[Run]) -> list[tuple[float, float]]:
    """The target error and the true error of each target that cost more than any picture does.

    Examples
    --------
    >>> rows = ((8.0, 1.0, 2.0), (4.0, 1.05, 1.9), (1.0, 3.0, 0.9))
    >>> needed_samples({"asked_255": a, "cpu_seconds": s, "rmse_255": e} for a, s, e in rows)
    [(1.0, 0.9)]
    """
    targets = [(run["asked_255"], run) for run in runs]
    costs = [run["cpu_seconds"] for asked, run in targets if asked is not None]
    return [
        (asked, run["rmse_255"])
        for asked, run in targets
        if asked is not None and run["cpu_seconds"] > FLOOR * min(costs)
    ]


def _precision(scene: str, pairs: Sequence[tuple[float, float]]) -> Precision:
    ratios = [true / asked for asked, true in pairs]
    return Precision(
        scene=scene,
        targets=len(ratios),
        kept=sum(ratio <= 1 for ratio in ratios),
        least=round(min(ratios), 2),
        median=round(statistics.median(ratios), 2),
        most=round(max(ratios), 2),
    )


def _ratio(ours: float | None, theirs: float | None) -> float | None:
    return None if ours is None or theirs is None else ours / theirs


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)
