"""CPU seconds of the renderer in one process, and where they go."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, TypedDict

import renderer
from benchmarks.clocks import Clock, clocked
from benchmarks.machine import Spread, render_seconds, spread
from benchmarks.settings import TIMED, Setting

if TYPE_CHECKING:
    from renderer.plan.plan import RenderPlan


class Timing(TypedDict):
    """One setting: its CPU seconds, its rays, and the share of the time by stage, 0 to 1."""

    setting: dict[str, Any]
    cpu_seconds: Spread
    rays: dict[str, int]
    shadow_rays_a_second: float
    stages: dict[str, float]


def measure(runs: int) -> list[Timing]:
    """Render every timed setting `runs` times, after one run that warms caches up."""
    return [_timing(setting, runs) for setting in TIMED]


def _timing(setting: Setting, runs: int) -> Timing:
    plan = setting.plan()
    rays = renderer.render(plan).report["rays"]
    seconds = spread([render_seconds(plan) for _ in range(runs)])
    return Timing(
        setting=dataclasses.asdict(setting),
        cpu_seconds=seconds,
        rays=rays,
        shadow_rays_a_second=round(rays["shadow"] / seconds["median"]),
        stages=_shares(plan),
    )


def _shares(plan: RenderPlan) -> dict[str, float]:
    """Share of the CPU time by class of stage; `rest` is camera rays, pixels and the way between stages."""
    clock: Clock = {}
    timed = clocked(plan, clock, lambda stage: type(stage).__name__)
    total = render_seconds(timed)
    ordered = sorted(clock.items(), key=lambda item: -item[1])
    shares = {name: round(seconds / total, 3) for name, seconds in ordered}
    return shares | {"rest": round(1 - sum(clock.values()) / total, 3)}
