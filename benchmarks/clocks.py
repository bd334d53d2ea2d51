"""How long each stage of a plan runs."""

from __future__ import annotations

import dataclasses
import time
from typing import TYPE_CHECKING, Any

from renderer.plan.stages import Lighting

if TYPE_CHECKING:
    from collections.abc import Callable

    from renderer.plan.plan import RenderPlan

Clock = dict[str, float]
"""CPU seconds by name."""


@dataclasses.dataclass(frozen=True)
class _Clocked:
    """A stage of any kind that notes how long it ran."""

    stage: Any
    name: str
    clock: Clock

    def run(self, work: Any) -> None:
        begun = time.process_time()
        self.stage.run(work)
        self.clock[self.name] = self.clock.get(self.name, 0.0) + time.process_time() - begun


def clocked(plan: RenderPlan, clock: Clock, name_of: Callable[[Any], str]) -> RenderPlan:
    """The same plan, whose stages add to a clock, each under its name."""

    def each(stages: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(_Clocked(stage, name_of(stage), clock) for stage in stages)

    lightings = [
        dataclasses.replace(light, shadows=each(light.shadows), terms=each(light.terms))
        for light in plan.lightings
        if isinstance(light, Lighting)
    ]
    return dataclasses.replace(
        plan,
        intersectors=each(plan.intersectors),
        visible_lights=each(plan.visible_lights),
        surfaces=each(plan.surfaces),
        lightings=tuple(lightings),
    )
