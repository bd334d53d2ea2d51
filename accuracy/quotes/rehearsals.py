"""CPU seconds of target quality, from the first passes of the picture itself, or of a part of it.

What a picture takes depends on what its pilot samples and samples find. So the picture is begun; where there
is time, it is finished, and its cost is known. Else its passes up to the first probes are rendered, in a part
that fits the time: squares from all over the picture, as target quality decides by neighbours and by sums
over a picture. The allocation then says how many samples are to follow.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from accuracy.quotes import places
from accuracy.quotes.deadlines import Deadline
from accuracy.quotes.settings import compiled, target
from accuracy.quotes.timings import UNSTEADY
from accuracy.statistics import factor
from renderer.adaptive.adaptive_render import AdaptiveRender, attempt
from renderer.adaptive.decisions import outlook
from renderer.adaptive.driver import Driver
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.levels import SAMPLED
from renderer.adaptive.requests import TileRequest
from renderer.adaptive.samples import Samples
from renderer.adaptive.states import State
from renderer.cameras import Mosaic
from renderer.math.intervals import Interval
from renderer.plan.plan import RenderPlan, seen_by
from renderer.scenes import LoadedScene
from schemas.quality import CONFIDENCE

PILOT, BORDERS, SAMPLES = "pilot samples", "borders", "samples"
"""Kinds of passes."""

KINDS = {State.PREVIEW: PILOT, State.LATTICE: PILOT, State.BORDERS: BORDERS}
"""By the state of a picture; all others sample."""

USUAL = {PILOT: 3.0, BORDERS: 0.3, SAMPLES: 1.0}
"""CPU seconds of their rays over those of one with few light points in a block, about: pilot samples have
many light points, and few rays at borders are lit."""

SPARE = 1.3
"""Times the predicted seconds that have to be left for a pass."""

WHOLE, PART = 0.5, 0.35
"""Share of the time left that the pilot samples of the whole picture, or of a part, may take: borders and
probes follow."""

SMALLEST = 1 / 32
"""Smallest share of a picture that says something of the whole."""

SIDE = 32
"""Side of the squares of a part, pixels: a sixteenth of their pixels lie beside a square from elsewhere."""

FEWEST = 8
"""Squares of a part: fewer say little of the others."""

DENSER = 0.75
"""What pilot samples of finer lattices cost, over those of the first: they are more and closer together."""

FURTHER = 4
"""Pilot samples of the next finer lattice for each of this one."""

ROUNDS, OF_MORE = 1.15, 0.5
"""Times the predicted samples that are taken. Samples come in rounds, and each may find what was not
expected. A part of a picture needs too many: its error is less sure than that of the whole."""

PASSES = 0.08
"""CPU seconds of the passes themselves, however few rays they have."""

PREDICTED, OF_A_PART = 0.15, 0.3
"""Standard deviations of the logarithm of the CPU time where its samples are predicted, by the whole picture
and by a part of it."""


def mosaic(plan: RenderPlan, share: float) -> Mosaic | None:
    """The camera of about this share of a picture; None if it has too few squares to choose from."""
    cells = places.cells(plan.width, plan.height, SIDE, plan.seed)
    whole = [(cell.x0, cell.y0) for cell in cells if cell.width == cell.height == SIDE]
    count = max(FEWEST, round(share * plan.width * plan.height / SIDE**2))
    return Mosaic.of(plan.camera, SIDE, np.array(whole[:count])) if count < len(whole) else None


@dataclass(slots=True)
class Rehearsal:
    """A picture of target quality, as far as there was time for it.

    Attributes
    ----------
    scene : LoadedScene
    error : float
    precision : str
    ray_seconds : float
        CPU seconds of a camera ray with few light points, about.
    confidence : float
        Share of pictures that are to keep the target.
    whole : bool
        Whether the whole picture was rendered to its end.
    found : float or None
        CPU seconds of the whole picture: those that it took, or that are predicted.
    unsure : float
        Standard deviation of their logarithm.
    reached : Interval or None
        The error of the whole picture, where it was rendered to its end.
    """

    scene: LoadedScene
    error: float
    precision: str
    ray_seconds: float
    confidence: float = CONFIDENCE
    whole: bool = False
    found: float | None = None
    unsure: float = field(default=UNSTEADY)
    reached: Interval | None = None

    def run(self, deadline: Deadline) -> None:
        """Render until the deadline."""
        plan = compiled(self.scene, target(self.error, self.precision, confidence=self.confidence))
        trial = Trial(plan, deadline, self.ray_seconds)
        if trial.lasts() * SPARE <= deadline.left:
            trial.step()
        if trial.pilot_seconds() <= WHOLE * deadline.left:
            self._finish(trial)
        elif deadline.left > 0:
            self._predict(plan, trial)

    def _finish(self, trial: "Trial") -> None:
        """Render the whole picture, as far as that goes."""
        while trial.more and (not trial.probed or trial.lasts() * SPARE <= trial.deadline.left):
            trial.step()
            if trial.probed and not trial.late:
                self._note(trial.cpu_seconds + trial.prices[SAMPLES] * ROUNDS * trial.outlook(), PREDICTED)
        if not trial.more and not trial.late:
            self.whole, self.reached = True, trial.reached()
            self._note(trial.cpu_seconds, 0.0)

    def _predict(self, plan: RenderPlan, whole: "Trial") -> None:
        """Render a part of the picture up to its probes, and take its rays to cost as much as elsewhere."""
        prices = whole.prices | {PILOT: whole.prices[PILOT] * DENSER}
        share = PART * whole.deadline.left / max(prices[PILOT] * _most_pilot_samples(plan), 1e-9)
        camera = mosaic(plan, max(share, SMALLEST))
        trial = Trial(seen_by(plan, camera) if camera else plan, whole.deadline, self.ray_seconds)
        while trial.more and not trial.probed:
            trial.step()
        if trial.late:
            return
        rays = trial.rays + Counter({SAMPLES: round(OF_MORE * trial.outlook())})
        seconds = sum(count * prices[kind] for kind, count in rays.items())
        self._note(PASSES + seconds * plan.width * plan.height / trial.pixels, OF_A_PART)

    def _note(self, found: float, unsure: float) -> None:
        self.found, self.unsure = found, float(np.hypot(unsure, UNSTEADY))

    def cpu_seconds(self) -> Interval | None:
        """CPU seconds of the whole picture, None if nothing is known of them."""
        return None if self.found is None else factor(self.unsure).scaled(self.found)


class Trial:
    """The passes of a picture or of a mosaic of it, one by one.

    Attributes
    ----------
    deadline : Deadline
    ray_seconds : float
        CPU seconds of a camera ray with few light points, about.
    more : bool
        Whether passes are to come.
    late : bool
        Whether the deadline came in the middle of a pass: it is over, and none is to come.
    prices : dict
        CPU seconds of a ray by kind of pass, as the last one of its kind has shown.
    rays : Counter
        Camera rays so far, by kind.
    """

    def __init__(self, plan: RenderPlan, deadline: Deadline, ray_seconds: float) -> None:
        self.deadline, self.more, self.late = deadline, True, False
        self.prices = {kind: times * ray_seconds for kind, times in USUAL.items()}
        self.rays: Counter[str] = Counter()
        self._render = AdaptiveRender(Driver.begin(plan))
        self._camera = plan.camera if isinstance(plan.camera, Mosaic) else None
        if self._camera is not None and plan.adaptive is not None:
            whole = self._camera.whole
            self._begin_as_whole(plan.adaptive.policy.first_stride(whole.width, whole.height))

    def _begin_as_whole(self, stride: int) -> None:
        """Begin with the lattice of the whole picture, which has more pixels."""
        estimate = self._render.estimate
        level = estimate.want.max()
        estimate.want[...] = 0
        estimate.want[::stride, ::stride] = level
        estimate.shown[...] = estimate.want >= SAMPLED
        estimate.stride = stride

    @property
    def pixels(self) -> int:
        """How many the picture has."""
        return self._render.estimate.have.size

    @property
    def kind(self) -> str:
        """What the next pass does."""
        return KINDS.get(self._render.estimate.state, SAMPLES)

    @property
    def probed(self) -> bool:
        """Whether samples say how many others are to follow."""
        return self._render.estimate.state.is_measured

    @property
    def wanted(self) -> int:
        """Camera rays of the next pass."""
        return self._render.estimate.rays_wanted()

    @property
    def cpu_seconds(self) -> float:
        """Spent so far."""
        return self._render.cpu_seconds

    def step(self) -> None:
        """Render a pass; the first one to its end, others as far as there is time."""
        kind, wanted, before = self.kind, self.wanted, self.cpu_seconds
        self.more = self._render.step(self._each)
        if self.late:
            return
        self.rays[kind] += wanted
        self.prices[kind] = (self.cpu_seconds - before) / max(wanted, 1)
        if self._camera is not None:
            self._forget_borders(self._camera)

    def _each(self, requests: list[TileRequest]) -> Iterator[tuple[TileRequest, Samples | None]]:
        for request in requests:
            # Before the first pass there is nothing that a picture could be interpolated from.
            self.late = self.late or bool(self.rays and self.deadline.left < 0)
            yield request, None if self.late else attempt(self._render.plan, request)

    def _forget_borders(self, camera: Mosaic) -> None:
        """Expect nothing of borders between squares: there are none in the picture."""
        estimate, joints = self._render.estimate, camera.borders()
        np.copyto(estimate.cover, estimate.coverage, where=joints)
        if estimate.state is State.PROBES:
            estimate.strata[joints], estimate.shown[joints] = 0, False
            np.copyto(estimate.want, estimate.have, where=joints)

    def reached(self) -> Interval:
        """The error of the picture so far, as target quality reports it."""
        error = self._render.estimate.error
        assert error is not None
        return Interval(error.estimate, error.low, error.high)

    def pilot_seconds(self) -> float:
        """CPU seconds of the passes up to the borders, if finer lattices ask for as much as this one."""
        stride = self._render.estimate.stride
        return self.lasts() * DENSER * sum(FURTHER**pass_ for pass_ in range(stride.bit_length()))

    def lasts(self) -> float:
        """CPU seconds of the next pass, if its rays cost as much as those of the last of its kind."""
        return self.wanted * self.prices[self.kind]

    def outlook(self) -> int:
        """Camera rays of the passes to come, after the probes."""
        return max(outlook(self._render.estimate), self.wanted) if self.more else 0


def _most_pilot_samples(plan: RenderPlan) -> float:
    """Pilot samples of a picture that is nowhere smooth."""
    piloted = plan.adaptive is not None and plan.adaptive.pilot is not None
    return plan.width * plan.height if piloted else Estimate.begin(plan).rays_wanted()
