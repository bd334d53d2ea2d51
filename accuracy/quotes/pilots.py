"""The pilot of a quote: the renders that it makes within its time, and the prices that follow."""

from dataclasses import dataclass, field

from accuracy.quotes.accuracies import MEASURED_SAMPLES, Accuracy, Sampled, UnknownAccuracyError
from accuracy.quotes.choices import Adaptive, Fixed
from accuracy.quotes.deadlines import Deadline
from accuracy.quotes.rehearsals import Rehearsal, rehearse
from accuracy.quotes.settings import LADDER_ERRORS, Ladder, own_ladder, planned, sobol_ladder, target
from accuracy.quotes.timings import Stopwatch, effect_shares
from accuracy.variations import Variant
from renderer.plan.plan import RenderPlan
from renderer.scenes import LoadedScene
from schemas.quality import CONFIDENCE, TargetQuality

REQUESTED_TIME_SHARE, OTHERS_TIME_SHARE = 0.7, 0.2
"""Shares of the remaining time for each requested quality, and then for each further part: most pictures of
256 pixels are rendered to 2/255 in 0.7 of 1.5 s, so that their cost is known."""

NO_TIME = "There was no time to sample pixels for an estimate of the error."
"""Reason for an unknown error if other work took all the time."""


@dataclass(slots=True)
class Pilot:
    """Renders as much of a scene as its time allows.

    Attributes
    ----------
    scene : LoadedScene
    plan : RenderPlan
        Of the requested quality.
    compiling : float
        CPU seconds of its compilation.
    ladders : list of Ladder
        The requested one, and another one if its errors fall faster.
    asked : int
        Samples requested on the first ladder.
    timings : list of Stopwatch
        Of the first ladders.
    """

    scene: LoadedScene
    plan: RenderPlan
    compiling: float
    ladders: list[Ladder] = field(init=False)
    asked: int = field(init=False)
    timings: list[Stopwatch] = field(default_factory=list)
    sampled: Sampled | None = None
    effects: list[tuple[Variant, float]] = field(default_factory=list)
    rehearsals: dict[float, Rehearsal] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Choose the ladders."""
        own, self.asked = own_ladder(self.scene.document.sampling, self.plan.quality)
        other = sobol_ladder(own.precision)
        # With target quality the scene's own ladder is irrelevant, and equal ladders count once.
        self.ladders = [other] if self.target or own == other else [own, other]

    @property
    def target(self) -> TargetQuality | None:
        """The requested target quality, if it is one."""
        return self.plan.quality if isinstance(self.plan.quality, TargetQuality) else None

    def run(self, seconds: float, error: float | None) -> None:
        """Render for so many seconds, beginning with the requested quality and error."""
        deadline = Deadline.after(seconds)
        if self.target is not None:
            self._rehearse(self.target.error, deadline.part(REQUESTED_TIME_SHARE))
        if error is not None:
            self._rehearse(error, deadline.part(REQUESTED_TIME_SHARE))
        if self.target is None:
            self._time(self.plan, deadline.part(REQUESTED_TIME_SHARE))
        if deadline.left > 0:
            self._try_fixed(deadline)
        for each in (LADDER_ERRORS[0], LADDER_ERRORS[-1]):
            self._rehearse(each, deadline)

    def _try_fixed(self, deadline: Deadline) -> None:
        """Time the last ladder, leave out effects, and measure errors."""
        last = self.ladders[-1].quality(MEASURED_SAMPLES[-1])
        # No set is that of the picture.
        one, another = (planned(self.plan, last, seed) for seed in (1, 2))
        if len(self.timings) < len(self.ladders):
            self._time(one, deadline.part(OTHERS_TIME_SHARE))
        plan = one if self.target else self.plan
        self.effects = effect_shares(self.scene, plan, deadline.part(OTHERS_TIME_SHARE), self.compiling)
        self.sampled = Sampled((one, another), self.plan if len(self.ladders) > 1 else None)
        self.sampled.run(deadline.part(OTHERS_TIME_SHARE))

    def _time(self, plan: RenderPlan, deadline: Deadline) -> None:
        watch = Stopwatch(plan)
        watch.run(deadline)
        if watch.blocks:
            self.timings.append(watch)

    def _rehearse(self, error: float, deadline: Deadline) -> None:
        if error not in self.rehearsals and deadline.left > 0:
            quality = target(error, self.ladders[0].precision, confidence=self._confidence())
            self.rehearsals[error] = rehearse(planned(self.plan, quality), deadline)

    def _confidence(self) -> float:
        """Confidence of all target errors: the requested one, or the usual one."""
        return self.target.confidence if self.target else CONFIDENCE

    def fixed(self, workers: int) -> list[Fixed]:
        """Prices of the ladders."""
        return [
            Fixed(ladder, watch, *self._accuracy(other=ladder is not self.ladders[-1]), workers)
            for ladder, watch in zip(self.ladders, self.timings, strict=False)
        ]

    def _accuracy(self, *, other: bool) -> tuple[Accuracy | None, str | None]:
        """Errors of a ladder, or why they are not known."""
        if self.sampled is None or not self.sampled.pixels:
            return None, NO_TIME
        try:
            return self.sampled.accuracy(other=other), None
        except UnknownAccuracyError as unknown:
            return None, str(unknown)

    def adaptive(self, workers: int) -> Adaptive:
        """Prices of target quality."""
        return Adaptive(self.rehearsals, self.ladders[0].precision, workers, self._confidence())
