"""The tasks of a study, the most informative first."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from accuracy.study.settings import REFERENCE_PATTERN, Scale, Setting, fixed, swept
from accuracy.study.tasks import Subject, Task
from accuracy.variations import few_samples, resized, variants
from renderer.compiling import compile_scene
from renderer.scenes import LoadedScene
from schemas.quality import FixedQuality, TargetQuality

if TYPE_CHECKING:
    from accuracy.study.tasks import Part
    from schemas.quality import Quality

REFERENCE_SEEDS = (1 << 31, (1 << 31) + 1)
"""Seeds of the halves of the reference; those of settings count from 1."""

REFERENCE_POINTS = 4
"""Light points for each camera sample of a reference."""

PRICED_LIGHT_POINTS = 64
"""Light points of the plan from which the cost of one is derived."""

MAX_REPEATED_SECONDS = 1.0
"""Settings that take longer are rendered once, CPU seconds; their interval comes from the pixels."""

DOUBLE_PRECISION_RUNS = (("sobol", 16, min), ("uniform", 4, max))
"""Method, camera samples and least or most light points of the runs in double precision: the time of the one
goes into rays, that of the other into pairs of points and light points."""

EFFECT_SAMPLES = 16
"""Most camera samples, and most light points, of the pictures without an effect."""

LONGEST_OWN = 20.0
"""The scene is rendered at its own size if that takes at most so many CPU seconds, to measure their
growth."""


@dataclass(eq=False)
class Program:
    """The tasks of a study.

    Parameters
    ----------
    scene : LoadedScene
    scale : Scale
    place : str
        Digest of the machine.
    """

    scene: LoadedScene
    scale: Scale
    place: str

    @cached_property
    def subject(self) -> Subject:
        """The whole scene at the size of the study."""
        return Subject.of(self._at(self.scale.side))

    @cached_property
    def area_lights(self) -> bool:
        """Whether the number of light points makes a difference."""
        return compile_scene(self.subject.scene, fixed(REFERENCE_PATTERN, 1, 4).quality).light_points > 1

    @cached_property
    def settings(self) -> tuple[Setting, ...]:
        """All settings, by method."""
        return tuple(swept(self.scale, area_lights=self.area_lights))

    def references(self, samples: int) -> tuple[Task, Task]:
        """Both halves of a reference with these camera samples each."""
        quality = fixed(REFERENCE_PATTERN, samples, REFERENCE_POINTS).quality
        first, second = (
            self._task("reference", f"reference {number}", quality, seed, kept=True)
            for number, seed in enumerate(REFERENCE_SEEDS, start=1)
        )
        return first, second

    def rounds(self, judges: tuple[Task, Task]) -> list[Task]:
        """Timed tasks: a round for each seed, with the cheap settings first."""
        tasks = []
        for seed in range(1, self.scale.seeds + 1):
            settings = [self._setting(setting, seed, judges) for setting in self.settings]
            wanted = [task for task in settings if seed == 1 or self.price(task) <= MAX_REPEATED_SECONDS]
            wanted += [*self._doubles(wanted, judges), *self._effects(seed), *self._own_size(seed)]
            tasks += sorted(wanted, key=self._order)
        return tasks

    def picture(self, setting: Setting, judges: tuple[Task, Task]) -> Task:
        """The task of a setting whose picture is kept."""
        return self._task("picture", setting.name, setting.quality, 1, judges=judges, kept=True)

    def warm_up(self) -> list[Task]:
        """The cheapest setting of each method: measured runs must not include imports and first allocations.

        The last one is large enough to measure the speed of the machine.
        """
        cheapest = {setting.method: setting for setting in reversed(self.settings)}
        return [self._setting(setting, 1, ()) for setting in (*cheapest.values(), self._small)]

    def price(self, task: Task) -> float:
        """Expected CPU seconds by the plan of the whole scene; for target quality a guess."""
        camera, studied = task.subject.scene.document.camera, self.subject.scene.document.camera
        pixels = camera.width * camera.height / (studied.width * studied.height)
        if isinstance(task.quality, TargetQuality):
            return pixels * max(1.0, 2 / (255 * task.quality.error)) * self._price_of(4, 4)
        assert task.quality.antialiasing is not None
        assert task.quality.light is not None
        return pixels * self._price_of(task.quality.antialiasing.samples, task.quality.light.samples)

    def _price_of(self, samples: int, points: int) -> float:
        # Both are few compilations: with a large mesh each takes as long as a small picture.
        one, many = self._prices
        return samples * (one + (many - one) * (points - 1) / (PRICED_LIGHT_POINTS - 1))

    @cached_property
    def _prices(self) -> tuple[float, float]:
        """Of one camera sample with one light point, and with `PRICED_LIGHT_POINTS`."""
        one, many = (
            compile_scene(self.subject.scene, fixed(REFERENCE_PATTERN, 1, points).quality)
            .describe()
            .cost.cpu_seconds
            for points in (1, PRICED_LIGHT_POINTS)
        )
        return one, many

    def _order(self, task: Task) -> float:
        # A picture comes after the one it is compared with, even if it is cheaper.
        return max(self.price(task), self.price(task.against)) if task.against else self.price(task)

    def _at(self, side: int) -> LoadedScene:
        return LoadedScene(resized(self.scene.document, side), self.scene.assets)

    def _setting(self, setting: Setting, seed: int, judges: tuple[Task, ...]) -> Task:
        kept = setting in self._doubled
        return self._task("setting", setting.name, setting.quality, seed, judges=judges, kept=kept)

    def _task(
        self, part: Part, name: str, quality: Quality, seed: int, subject: Subject | None = None, **more: Any
    ) -> Task:
        """A task on this machine; its subject is the whole scene unless another is given."""
        return Task(part, name, subject or self.subject, quality, seed, self.place, **more)

    @cached_property
    def _doubled(self) -> list[Setting]:
        """The settings that `DOUBLE_PRECISION_RUNS` names."""
        return [
            choice(
                (known for known in self.settings if known.method == method and known.samples == samples),
                key=lambda known: known.points,
            )
            for method, samples, choice in DOUBLE_PRECISION_RUNS
        ]

    def _doubles(self, singles: list[Task], judges: tuple[Task, Task]) -> list[Task]:
        return [
            self._task("precision", single.name, double, single.seed, judges=judges, against=single)
            for single in singles
            if single.kept
            for double in [single.quality.model_copy(update={"precision": "double"})]
        ]

    @cached_property
    def _without(self) -> list[Subject]:
        return [
            Subject.of(LoadedScene(variant.document, self.scene.assets), variant.effect, variant.pointers)
            for variant in variants(self.subject.scene.document)
        ]

    def _effects(self, seed: int) -> list[Task]:
        whole = self._task("whole", "all effects", _own_quality(self.subject), seed, kept=True)
        return [whole] + [
            self._task("effect", part.effect, _own_quality(part), seed, subject=part, against=whole)
            for part in self._without
        ]

    def _own_size(self, seed: int) -> list[Task]:
        camera = self.scene.document.camera
        side = max(camera.width, camera.height)
        if side <= self.scale.side:
            return []
        subject = Subject.of(self._at(side))
        task = self._task("size", self._small.name, self._small.quality, seed, subject=subject)
        return [task] if self.price(task) <= LONGEST_OWN else []

    @cached_property
    def _small(self) -> Setting:
        """The best pattern's first setting with 4 camera samples."""
        return next(
            known for known in self.settings if known.method == REFERENCE_PATTERN and known.samples == 4
        )


def _own_quality(subject: Subject) -> FixedQuality:
    return few_samples(subject.scene.document.sampling, EFFECT_SAMPLES, EFFECT_SAMPLES)
