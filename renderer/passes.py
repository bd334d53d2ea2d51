"""The loop over the passes of a picture of any quality, and the tally of its cost."""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from renderer.film import Image, non_finite
from renderer.integrator import WORK_COUNTERS
from renderer.plan.plan import RenderPlan

Transport = Callable[[list[Any]], Iterator[tuple[Any, Any]]]
"""Runs the tasks of a pass somewhere, and gives each with its result, in any order."""


class Picture(Protocol):
    """A picture in progress, whose tasks and results are its own."""

    def tasks(self) -> list[Any]:
        """Return the tasks of the next pass."""

    def take(self, task: Any, result: Any) -> None:
        """Add a result to the picture."""

    def end_pass(self) -> bool:
        """Close the pass; False if none follows."""


def run_pass(picture: Picture, transport: Transport) -> bool:
    """Run the next pass of a picture; False if none follows."""
    for task, result in transport(picture.tasks()):
        picture.take(task, result)
    return picture.end_pass()


@dataclass(slots=True)
class Tally:
    """Rays, work and seconds that a picture has taken so far, and had taken when each pass ended.

    Attributes
    ----------
    begun : float
        By the clock of `time.monotonic`, seconds.
    rays, work : Counter
        By kind; work as in `integrator.WORK_COUNTERS`.
    cpu_seconds : float
        Of all processes.
    passes : list of dict
        Totals when each pass ended, and the error by then, where it is known.
    """

    begun: float = field(default_factory=time.monotonic)
    rays: Counter[str] = field(default_factory=Counter)
    work: Counter[str] = field(default_factory=lambda: Counter(dict.fromkeys(WORK_COUNTERS, 0)))
    cpu_seconds: float = 0.0
    passes: list[dict[str, Any]] = field(default_factory=list)

    @property
    def seconds(self) -> float:
        """Seconds since the picture was begun."""
        return time.monotonic() - self.begun

    def count(self, rays: Mapping[str, int], work: Mapping[str, int], cpu_seconds: float) -> None:
        """Add the price of a tile."""
        self.rays.update(rays)
        self.work.update(work)
        self.cpu_seconds += cpu_seconds

    def end_pass(self, error: dict[str, Any] | None) -> None:
        """Keep the price of the picture at the end of a pass."""
        cost = {"seconds": self.seconds, "cpu_seconds": self.cpu_seconds, "rays": dict(self.rays)}
        self.passes.append(cost | {"error": error})

    def report(self, plan: RenderPlan, image: Image, samples: float, clamped: int) -> dict[str, Any]:
        """Describe the finished picture, as `penumbra render --json` prints it.

        Parameters
        ----------
        samples
            Camera rays of a pixel in the mean.
        clamped
            Pixels that are shown darker than they are.
        """
        lights = [lighting.emitter.count for lighting in plan.lightings]
        return {
            "seconds": self.seconds,
            "cpu_seconds": self.cpu_seconds,
            "width": plan.width,
            "height": plan.height,
            "rays": dict(self.rays),
            "work": dict(self.work),
            "samples": {
                "antialiasing_mean": samples,
                "light_mean": float(np.mean(lights)) if lights else 0.0,
            },
            "error": self.passes[-1]["error"],
            "passes": self.passes,
            "numerics": {"non_finite": non_finite(image), "clamped": clamped} | plan.numerics,
            "plan": plan.describe().model_dump(mode="json"),
        }
