"""Runner of a study: renders the pictures that its journal lacks, and estimates the remaining time."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from accuracy.statistics import clipped, rms_difference
from accuracy.study import results
from accuracy.study.journal import Journal, describe
from accuracy.study.program import Program
from accuracy.study.reference import Reference
from accuracy.study.tasks import place_key
from accuracy.variations import seeded
from renderer.compiling import compile_scene
from renderer.rendering import render

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from accuracy.study.settings import Scale
    from accuracy.study.tasks import Task
    from renderer.scenes import LoadedScene

REFERENCE_SHARE = 0.4
"""Share of a budget for the reference."""

ROUNDS_SHARE = 0.9
"""Share of a budget for timed runs; the pictures at equal time come last."""


@dataclass(frozen=True, slots=True)
class Forecast:
    """Progress of a study, and the time left.

    Attributes
    ----------
    runs, done : int
        Pictures to render, and those that are in the journal.
    share : float
        Finished share of the expected work, 0 to 1.
    seconds : float
        Expected seconds left; at most the rest of the budget.
    now : str
        The current task.
    """

    runs: int
    done: int
    share: float
    seconds: float
    now: str = ""


class Study:
    """A study of one scene: the tasks, their journal and their budget.

    Everything is rendered in this process, one picture at a time, and seconds are its CPU seconds.

    Parameters
    ----------
    scene : LoadedScene
    folder : Path
        Folder of the journal; created if it does not exist.
    scale : Scale
        Extent of the study.
    budget : float, optional
        Wall-clock seconds after which no run begins. The last run may exceed it by the error of its forecast.

    Raises
    ------
    SceneError
        If the scene, or a file that it names, cannot be used.
    OSError
        If the folder cannot be made or read.
    """

    def __init__(self, scene: LoadedScene, folder: Path, scale: Scale, budget: float | None = None) -> None:
        self.machine = describe()
        self.program = Program(scene, scale, place_key(self.machine))
        compile_scene(self.program.subject.scene)
        self._deadline = None if budget is None else time.monotonic() + budget
        self._budget = budget
        self._journal = Journal(folder)
        self._measured = self._expected = self._preparing = 0.0
        self._known: dict[tuple[str, str], float] = {}
        self._wall = self._cpu = 0.0
        self._warm_up()
        self.references = self._references()
        self.tasks = self.program.rounds(self.references)
        self._learn()

    def forecast(self, now: str = "") -> Forecast:
        """Progress and time left, without the pictures at equal time."""
        tasks = [*self.references, *self.tasks]
        done = [task.key in self._journal for task in tasks]
        expected = [self._expected_seconds(task) for task in tasks]
        seconds = sum(one for one, is_done in zip(expected, done, strict=True) if not is_done)
        spent = sum(expected) - seconds
        if self._deadline is not None:
            seconds = min(seconds, max(0.0, self._deadline - time.monotonic()))
        share = spent / (spent + seconds) if any(done) else 0.0
        return Forecast(len(tasks), sum(done), share, seconds, now)

    def run(self, report: Callable[[Forecast], None]) -> dict[str, Any]:
        """Render all that is missing and fits the budget, and give the results.

        Parameters
        ----------
        report : callable
            Called with a `Forecast` before every run.

        Raises
        ------
        RenderError
            A picture cannot be rendered.
        """
        for task in self.references:
            self._do(task, report)
        for task in self.tasks:
            if self._fits(task, ROUNDS_SHARE):
                self._do(task, report)
        document = results.document(self.program, self.references, self.tasks, self._journal, self.machine)
        return document | {"pictures": self._pictures(document, report)}

    def picture(self, key: str) -> Any:
        """A picture of the study by its key, (H, W, 3) float32 linear."""
        return self._journal.picture(key)

    @cached_property
    def reference(self) -> Reference:
        """The reference; its halves have been rendered."""
        first, second = (clipped(self._journal.picture(task.key)) for task in self.references)
        return Reference(first, second)

    @property
    def _slowness(self) -> float:
        """Measured CPU seconds over expected ones."""
        return self._measured / self._expected if self._expected else 1.0

    def _warm_up(self) -> None:
        *warm, last = self.program.warm_up()
        for task in warm:
            self._timed(task)
        entry, _ = self._timed(last)
        self._preparing = entry["prepare_seconds"]
        self._count(last, entry["cpu_seconds"])

    def _learn(self) -> None:
        """Prefer earlier measurements to those of the warm-up."""
        known = [task for task in self.tasks if task.key in self._journal]
        if known:
            self._measured = self._expected = 0.0
        for task in known:
            self._count(task, self._journal[task.key]["cpu_seconds"])

    def _count(self, task: Task, seconds: float) -> None:
        self._measured += seconds
        self._expected += self.program.price(task)
        self._known[task.part, task.name] = seconds

    def _expected_seconds(self, task: Task) -> float:
        """Expected wall-clock seconds, by another seed or else by the plan, preparation included."""
        known = self._known.get((task.part, task.name))
        cpu = self._preparing + (self.program.price(task) * self._slowness if known is None else known)
        return cpu * self._wall / self._cpu

    def _timed(self, task: Task) -> tuple[dict[str, Any], Any]:
        begun = time.monotonic()
        entry, image = _timed(task)
        self._wall += time.monotonic() - begun
        self._cpu += entry["prepare_seconds"] + entry["cpu_seconds"]
        return entry, image

    def _references(self) -> tuple[Task, Task]:
        """The reference that was begun before, or else the best that the budget allows."""
        levels = [self.program.references(samples) for samples in self.program.scale.references]
        begun = (level for level in levels if any(self._is_done(half) for half in level))
        fitting = (
            level
            for level in levels
            if self._budget is None
            or sum(map(self._expected_seconds, level)) <= REFERENCE_SHARE * self._budget
        )
        return next(begun, None) or next(fitting, levels[-1])

    def _fits(self, task: Task, share: float = 1.0) -> bool:
        if self._deadline is None or self._budget is None:
            return True
        end = self._deadline - (1 - share) * self._budget
        return time.monotonic() + self._expected_seconds(task) <= end

    def _is_done(self, task: Task) -> bool:
        return task.key in self._journal and (not task.kept or self._journal.has_picture(task.key))

    def _do(self, task: Task, report: Callable[[Forecast], None]) -> None:
        if self._is_done(task) or (task.against and not self._is_done(task.against)):
            return
        report(self.forecast(task.name))
        entry, image = self._timed(task)
        if task.judges:
            entry["judgement"] = asdict(self.reference.judge(image))
        if task.against:
            entry["difference"] = rms_difference(image, self._journal.picture(task.against.key))
        self._journal.add(entry, image if task.kept else None)
        self._count(task, entry["cpu_seconds"])

    def _pictures(self, document: dict[str, Any], report: Callable[[Forecast], None]) -> list[dict[str, Any]]:
        rows = []
        for row in results.at_equal_time(document):
            setting = next(known for known in self.program.settings if known.name == row["name"])
            task = self.program.picture(setting, self.references)
            if self._fits(task):
                self._do(task, report)
                rows.append(row | {"key": task.key})
        return rows


def _timed(task: Task) -> tuple[dict[str, Any], Any]:
    """Render a picture; return its entry in the journal, and the picture."""
    begun = time.process_time()
    plan = compile_scene(seeded(task.subject.scene, task.seed), task.quality)
    prepared = time.process_time()
    result = render(plan)
    ended = time.process_time()
    report = result.report
    entry = {
        "key": task.key,
        "part": task.part,
        "name": task.name,
        "seed": task.seed,
        "prepare_seconds": prepared - begun,
        "cpu_seconds": ended - prepared,
        "rays": report["rays"],
        "stated_error": report["error"],
    }
    return entry, result.image
