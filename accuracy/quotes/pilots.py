"""The pilot of a quote: what it renders, in which order, and what becomes of it."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial

from accuracy.quotes.accuracies import SAMPLES, Accuracy, Sampled, UnknownAccuracyError
from accuracy.quotes.choices import Adaptive, Fixed, ordered
from accuracy.quotes.deadlines import Deadline, within
from accuracy.quotes.rehearsals import Rehearsal
from accuracy.quotes.settings import ERRORS, Ladder, compiled, own_ladder, sobol_ladder
from accuracy.quotes.timings import Stopwatch, effect_shares
from accuracy.variations import Variant
from renderer.plan.plan import RenderPlan
from renderer.scenes import LoadedScene
from schemas.quality import CONFIDENCE, Quality, TargetQuality

TIMING_AT_MOST = 0.6
"""Share of the time for timing blocks where they cost much or differ much."""

TIMING, EFFECTS = 0.25, 0.12
"""Shares of the time that is left for fixed samples, when their turn comes, for timing blocks and for leaving
out effects. What they leave is for sampling pixels."""

TARGETS = 0.65
"""Share of the time that is kept for target quality, however long all else takes: it is nearly always the
cheapest way to an error."""

LESS = 0.4
"""Share of that time for the largest of several errors: smaller ones take longer."""

SPARE = 0.1
"""Share of the time that is kept for what units of work take longer than the ones before."""

SEEDS = 101, 102
"""Added to the scene's seed for the two sets of samples: no set is that of the picture."""

QUICK = 0.04
"""Share of the time that compiling may take for plans that are not needed but welcome."""

NO_TIME = "There was no time to sample pixels for an estimate of the error."
"""Why no error is known where other work has taken all the time."""

SLOW = 1e-4
"""CPU seconds of a camera ray where not a single block could be timed: slower than nearly all are."""


@dataclass(slots=True)
class Pilot:
    """Renders as much of a scene as there is time for.

    Attributes
    ----------
    scene : LoadedScene
    quality : Quality or None
        The requested quality and goals.

    requested : float or None
        An error that matters more than others.
    plan : RenderPlan
        Of the requested quality.
    ladders : list of Ladder
        The requested one, and the one whose errors fall fastest, if that is another.
    asked : int
        Samples requested on the first ladder.
    """

    scene: LoadedScene
    quality: Quality | None
    requested: float | None
    plan: RenderPlan
    ladders: list[Ladder] = field(init=False)
    asked: int = field(init=False)
    stopwatch: Stopwatch | None = None
    sampled: Sampled | None = None
    effects: list[tuple[Variant, float]] = field(default_factory=list)
    rehearsals: list[Rehearsal] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Choose the ladders."""
        own, self.asked = own_ladder(self.scene.document.sampling, self.quality)
        other = sobol_ladder(own.precision)
        # With target quality the scene's own ladder is beside the point, and so is one that is the other.
        self.ladders = [other] if self.target or own == other else [own, other]

    @property
    def target(self) -> TargetQuality | None:
        """The requested target quality, if it is one."""
        return self.quality if isinstance(self.quality, TargetQuality) else None

    def run(self, seconds: float, compiling: float) -> None:
        """Render for so many seconds; compiling the plan has taken `compiling` seconds."""
        deadline = Deadline.after(seconds * (1 - SPARE))
        last = self.ladders[-1].quality(SAMPLES)
        for half in within(deadline, [partial(compiled, self.scene, last, SEEDS[0])], compiling):
            plans = [self.plan, half][-len(self.ladders) :]
            early = deadline.part(1 - TARGETS)
            self.stopwatch = Stopwatch(plans)
            self.stopwatch.run(early.part(TIMING), early.part(TIMING_AT_MOST))
            quality = self.ladders[0].quality(plans[0].antialiasing.samples)
            self.effects = effect_shares(self.scene, quality, plans[0], early.part(EFFECTS), compiling)
            self._sample(half, compiling, early)
            self._rehearse(deadline)

    def _sample(self, half: RenderPlan, compiling: float, deadline: Deadline) -> None:
        """Sample pixels with the plans of the last ladder, twice, and with those of the first."""
        last = self.ladders[-1].quality(SAMPLES)
        units = [partial(compiled, self.scene, last, SEEDS[1])]
        for other in within(deadline, units, compiling):
            welcome = compiling <= QUICK * deadline.left
            own = [dict(self._rungs(ladder, others_too=welcome)) for ladder in self.ladders[:-1]]
            self.sampled = Sampled(own, (half, other))
            self.sampled.run(deadline, self._ray_seconds())

    def _rungs(self, ladder: Ladder, *, others_too: bool) -> Iterator[tuple[int, RenderPlan]]:
        """Plans of the counts whose errors are measured: one that the others follow from, and these too."""
        nearest = min(self.asked, ladder.measured[-1])
        for count in sorted({nearest, *ladder.measured} if others_too else {nearest}):
            yield count, self.plan if count == self.asked else compiled(self.scene, ladder.quality(count))

    def _rehearse(self, deadline: Deadline) -> None:
        """Try the errors that matter most, the last of them as long as there is time."""
        precision, ray = self.ladders[0].precision, self._ray_seconds()
        errors = self._in_order()
        for number, error in enumerate(errors):
            rehearsal = Rehearsal(self.scene, error, precision, ray, self._confidence())
            rehearsal.run(deadline if number == len(errors) - 1 else deadline.part(LESS))
            self.rehearsals.append(rehearsal)

    def _in_order(self) -> list[float]:
        """Target errors: the requested ones, then the largest and the smallest of the others."""
        errors = self._errors()
        others = sorted({*ERRORS} - {*errors}, reverse=True)
        return list(dict.fromkeys([*errors, others[0], others[-1]]))

    def _errors(self) -> list[float]:
        """Requested target errors."""
        return [error for error in (self.target and self.target.error, self.requested) if error]

    def _confidence(self) -> float:
        """That of all target errors: the requested one, or the usual one."""
        return self.target.confidence if self.target else CONFIDENCE

    def _ray_seconds(self) -> float:
        """CPU seconds of a camera ray with few light points."""
        assert self.stopwatch is not None
        timing = self.stopwatch.timing(len(self.ladders) - 1) or self.stopwatch.timing(0)
        return timing.first.estimate / (self.plan.width * self.plan.height) if timing else SLOW

    def fixed(self, workers: int) -> list[Fixed]:
        """What is known of the ladders."""
        found = []
        for number, ladder in enumerate(self.ladders):
            timing = self.stopwatch.timing(number) if self.stopwatch else None
            if timing:
                found.append(Fixed(ladder, timing, *self._accuracy(number), workers))
        return found

    def _accuracy(self, number: int) -> tuple[Accuracy | None, str | None]:
        """Errors of a ladder, or why they are not known."""
        if self.sampled is None or not self.sampled.pixels:
            return None, NO_TIME
        try:
            return self.sampled.accuracy(number), None
        except UnknownAccuracyError as unknown:
            return None, str(unknown)

    def adaptive(self, workers: int) -> Adaptive:
        """What is known of target quality."""
        known = [(each.error, each.cpu_seconds()) for each in self.rehearsals]
        costs = ordered({error: cpu for error, cpu in known if cpu is not None})
        points = {error: (cpu, cpu.scaled(1 / workers)) for error, cpu in costs.items()}
        reached = {each.error: each.reached for each in self.rehearsals if each.reached is not None}
        return Adaptive(points, self.ladders[0].precision, self._confidence(), reached)
