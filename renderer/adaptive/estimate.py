"""The picture so far, what is known of its error, and what the next pass samples.

All decisions are made about the whole picture between passes, so that no pixel depends on tiles, and all
sums are formed in the order of pixels.
"""

from collections.abc import Iterable
from dataclasses import astuple, dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive import strata
from renderer.adaptive.allocation import allocate
from renderer.adaptive.findings import Findings, findings_of
from renderer.adaptive.halves import HALVES
from renderer.adaptive.lattice import COARSEST, Labels, Picture, cells_of, fill
from renderer.adaptive.levels import COUNTS, HIGHEST, LOOKED, SAMPLED, Levels
from renderer.adaptive.neighbours import outline, spread
from renderer.adaptive.samples import Samples, of_labels
from renderer.adaptive.uncertainty import SURE, ErrorEstimate, error_of
from renderer.arrays import Floats, Integers, Masks
from renderer.film import Image
from renderer.layers import Layers
from renderer.plan import RenderPlan
from schemas.quality import TargetQuality
from schemas.tiles import Tile

CALM = 0.5
"""Share of the wished error that interpolation may err by. It mostly errs by far less: the least smooth place
decides."""

MARGIN = 0.9
"""Share of the budget for samples and doubts together: what samples will meet is not known exactly."""

EASES = (1.0, 0.7, 0.5, 0.3, 0.1)
"""Shares of the goals, tried in turn until they ask for something: the error was not reached, so they were
set too high."""

LEAP = 3
"""Levels that a pixel may rise at once: few samples do not tell well how many more are needed."""

DOUBT = 0.2
"""Share of the budget that all strata together may be uncertain by."""

PROBED = SAMPLED + 2
"""Level of a new probe: 16 samples. With four, an edge at the rim of a pixel is met by both halves so seldom
that a stratum may seem to have no error."""

MOSTLY = 0.5
"""Share of a stratum's pixels that are probes from which on it is sampled as a whole."""

CLOSEST = 8
"""Highest level of a probe: 256 samples. What is still uncertain then needs more probes."""

FIND = 16.0
"""A probe found something if its squared error is so many times the wished one, and that of its like."""

FINE = 0.004
"""For this error and smaller ones all pixels at borders are probed: slivers of some are missed too often."""

MANY, MOST_PROBED = 4096, 0.25
"""Of more like pixels than these, no more than this share are probes: all would be to sample all."""

BLURRED = 2e-6
"""Squared error to expect of a texture's mean over a pixel: parts are averaged with a little around them."""

DARKEST = 2.0**-10
"""Darker textures than this are taken to be as bright, so that the light on them can be told."""

MOST_ROUNDS = 40
"""More has never been needed; it ends in any case."""

STRIDE, ROUND = 0, 1
"""Places in `Estimate.counters`: pixels between the first looks so far, and rounds of samples."""


@dataclass(slots=True)
class Estimate:
    """An adaptive picture.

    A pass brings the pixels from the levels that they `have` to those that it wants (`levels`). Between
    passes `advance` decides.

    Attributes
    ----------
    plan : RenderPlan
    values : (3, H, W) float32
        First looks, and what is interpolated between them.
    labels : (H, W) int32
        What the first looks met.
    colors : (3, H, W) float32
        What textures gave there, 1 where there was none.
    have, want : (H, W) uint8
    halves : (2, 3, H, W) float64
        Means of either half of the samples.
    squares : (H, W) float64
        Sum over the samples of squares about their mean, mean over channels.
    shown : (H, W) bool
        Pixels whose samples are shown, and not the first look.
    strata : (H, W) int64
    chances : (strata.COUNT,) float64
        Share of the pixels of each stratum that are probes.
    counters : (2,) int64
    error : ErrorEstimate or None
        None before anything is known.
    """

    plan: RenderPlan
    values: Picture
    labels: Labels
    colors: Picture
    have: Levels
    want: Levels
    halves: Floats
    squares: Floats
    shown: Masks
    strata: Integers
    chances: Floats
    counters: Integers
    error: ErrorEstimate | None = None

    @classmethod
    def begin(cls, plan: RenderPlan) -> "Estimate":
        """Nothing but what the first pass wants: first looks on a coarse lattice.

        A lens leaves nothing smooth between pixels, so all are sampled at once.
        """
        size = plan.height, plan.width
        looks = plan.look is not None
        want = np.zeros(size, dtype=np.uint8)
        want[::COARSEST, ::COARSEST] = LOOKED
        return cls(
            plan=plan,
            values=np.zeros((3, *size), dtype=np.float32),
            labels=np.zeros(size, dtype=np.int32),
            colors=np.ones((3, *size), dtype=np.float32),
            have=np.zeros(size, dtype=np.uint8),
            want=want if looks else np.full(size, SAMPLED, dtype=np.uint8),
            halves=np.zeros((HALVES, 3, *size)),
            squares=np.zeros(size),
            shown=np.full(size, not looks),
            strata=np.zeros(size, dtype=np.int64),
            chances=np.zeros(strata.COUNT),
            counters=np.array([COARSEST if looks else 1, 0 if looks else 1]),
        )

    @classmethod
    def restored(cls, plan: RenderPlan, arrays: dict[str, NDArray[Any]]) -> "Estimate":
        """The estimate that gave `arrays`."""
        known = dict(arrays)
        error = known.pop("error", None)
        return cls(plan, **known, error=None if error is None else ErrorEstimate(*error.tolist()))

    def arrays(self) -> dict[str, NDArray[Any]]:
        """All that it knows beside the plan."""
        known = {item.name: getattr(self, item.name) for item in fields(self)[1:-1]}
        if self.error is not None:
            known["error"] = np.array(astuple(self.error))
        return known

    @property
    def target(self) -> float:
        """The error asked for."""
        assert isinstance(self.plan.quality, TargetQuality)
        return self.plan.quality.error

    @property
    def budget(self) -> float:
        """Sum of squared errors, mean over channels, that the target allows."""
        return self.target**2 * self.have.size

    def take(self, tile: Tile, samples: Samples) -> None:
        """Add what this pass has found in a tile. The order of tiles does not matter."""
        part = np.s_[tile.y0 : tile.y1, tile.x0 : tile.x1]
        have, want = self.have[part], self.want[part]
        looked = (want == LOOKED) & (have < want)
        self.values[:, *part][:, looked] = samples.looks
        self.labels[part][looked] = samples.labels
        self.colors[:, *part][:, looked] = samples.colors
        more = (want > LOOKED) & (have < want)
        before, after = COUNTS[have[more]], COUNTS[want[more]]
        share = (after - before) / after
        halves = self.halves[:, :, *part]
        apart = samples.halves - halves[:, :, more]
        self.squares[part][more] += samples.squares + (apart.mean(axis=0) ** 2).mean(axis=0) * before * share
        halves[:, :, more] += apart * share
        np.maximum(have, want, out=have)

    def image(self) -> Image:
        """The picture so far, (H, W, 3) float32, linear."""
        return self.part(Tile(0, 0, 0, self.have.shape[1], self.have.shape[0]))

    def part(self, tile: Tile) -> Image:
        """The picture so far in a tile, (h, w, 3) float32, linear.

        Before the first looks have reached every pixel, each node of their lattice fills its square.
        """
        stride = int(self.counters[STRIDE])
        rows, columns = np.arange(tile.y0, tile.y1)[:, None], np.arange(tile.x0, tile.x1)
        y, x = rows // stride * stride, columns // stride * stride
        picture = self.values[:, y, x]
        coming = (self.want[y, x] == LOOKED) & (self.have[y, x] < LOOKED)
        if coming.any():
            above, beside = rows // (2 * stride) * (2 * stride), columns // (2 * stride) * (2 * stride)
            picture = np.where(coming, self.values[:, above, beside], picture)
        sampled = self.shown[y, x] & (self.have[y, x] >= SAMPLED)
        if sampled.any():
            picture[:, sampled] = self.halves[:, :, y, x][:, :, sampled].mean(axis=0)
        return np.ascontiguousarray(picture.transpose(1, 2, 0))

    def counts(self) -> Integers:
        """Camera samples that each pixel has got, (H, W): 1 for a first look alone, 0 in between.

        Those of a probe count, though it may show its first look.
        """
        return np.maximum(COUNTS[self.have], self.have > 0)

    def layers(self, names: Iterable[str]) -> Layers:
        """Those layers of a request that tell about samples."""
        known = {"samples": lambda: self.counts().astype(np.int32), "error": self.errors}
        return {name: known[name]() for name in names if name in known}

    def errors(self) -> Image:
        """Estimated standard errors of the pixels, (H, W, 3) float32: of first looks that of their like."""
        found = self._findings()
        looks = np.sqrt(np.maximum(found.survey.errors, 0))[self.strata]
        halves = np.abs(self.halves[0] - self.halves[1]) / 2
        return np.where(self.shown, halves, looks).transpose(1, 2, 0).astype(np.float32)

    def settle(self) -> ErrorEstimate:
        """The error of the picture as it is, in the middle of a pass or not.

        Before there are samples nothing is known of it but what the coarse picture lets expect.
        """
        if (self.have >= SAMPLED).any():
            found = self._findings()
            self.error = error_of(found.total, found.variance, self.have.size)
        elif self.error is None:
            expected = strata.expected_errors(self.image().transpose(2, 0, 1)).mean(dtype=np.float64)
            self.error = ErrorEstimate(float(np.sqrt(expected)), 0.0, 1.0, 1.0)
        return self.error

    def advance(self) -> bool:
        """Decide what the next pass wants, after all tiles of this one; False if the picture is done."""
        if self.counters[STRIDE] > 1:
            self._look_closer()
            return True
        self.counters[ROUND] += 1
        if self.counters[ROUND] == 1:
            self._choose_probes()
            return True
        return self._sample_more()

    def _look_closer(self) -> None:
        stride = int(self.counters[STRIDE])
        nodes = np.s_[::stride, ::stride]
        cells = cells_of(
            self.values[:, *nodes],
            self.labels[nodes],
            (self._fine() | self._thin())[nodes],
            CALM * self.target,
        )
        half = stride // 2
        finer = np.s_[::half, ::half]
        self.want[...] = 0
        self.want[finer][fill(self.values[:, *finer], self.labels[finer], cells)] = LOOKED
        self.counters[STRIDE] = half
        if half == 1:
            self.want[self._edges() & (self.have < LOOKED)] = LOOKED

    def _fine(self) -> Masks:
        """Pixels that show something that may be finer than the lattice, (H, W)."""
        return of_labels(self.plan.rough | self.plan.textured, self.labels)

    def _edges(self) -> Masks:
        """Pixels that edges of flat shapes pass, (H, W)."""
        passed = np.zeros(self.have.shape, dtype=bool)
        passed[self.plan.edges[1], self.plan.edges[0]] = True
        return passed

    def _thin(self) -> Masks:
        """Pixels near shapes that may lie between the nodes of the lattice, (H, W)."""
        near = np.zeros(self.have.shape, dtype=bool)
        near[self.plan.thin[1], self.plan.thin[0]] = True
        return spread(near, COARSEST) if near.any() else near

    def _choose_probes(self) -> None:
        expected = strata.expected_errors(self.values)
        if self.plan.textured.any():
            self._leave_textures_out(expected)
        rough = of_labels(self.plan.rough, self.labels)
        self.strata[...] = strata.strata_of(expected, self.labels, self.have, rough)
        even = (self.strata // strata.STEPS == strata.EVEN) & (outline(self.have.shape) | self._edges())
        self.strata[even] += strata.STEPS * (strata.BORDER - strata.EVEN)
        share = float(np.clip(2.0**-14 / self.target, 2.0**-7, 2.0**-2))
        self.chances[...] = strata.chances(self.strata, expected, share, self.budget)
        border = np.s_[strata.STEPS * strata.BORDER : strata.STEPS * (strata.BORDER + 1)]
        self.chances[border] = np.maximum(self.chances[border], min(FINE / self.target, 1.0))
        self.want[...] = PROBED * self._probes()

    def _leave_textures_out(self, expected: NDArray[np.float32]) -> None:
        """Expect of textures, whose mean the first look took, no error: only of the light on them.

        Beside another shape the light is no guide.
        """
        colors = np.maximum(self.colors, np.float32(DARKEST))
        unlike = of_labels(self.plan.textured, self.labels) & ~strata.borders(self.labels)
        light = strata.expected_errors(np.divide(self.values, colors, dtype=np.float32))
        light *= (colors**2).mean(axis=0)
        light += BLURRED
        np.copyto(expected, light, where=unlike)

    def _probes(self) -> Masks:
        return strata.lots(self.plan.seed, self.have.shape) < self.chances[self.strata]

    def _sample_more(self) -> bool:
        found = self._findings()
        self.error = error_of(found.total, found.variance, self.have.size)
        self.want[...] = 0
        if self.error.bound <= self.target or self.counters[ROUND] > MOST_ROUNDS:
            return False
        self._show_probed()
        found = self._findings()
        self._suspect(found)
        for ease in EASES:
            self._allot(found, ease)
            self._question(found, ease)
            if (self.want > self.have).any():
                return True
        return False

    def _findings(self) -> Findings:
        return findings_of(self.halves, self.squares, self.have, self.shown, self.values, self.strata)

    def _allot(self, found: Findings, ease: float) -> None:
        """Samples where they lower the error most; strata whose first look is not good enough show them."""
        room = MARGIN * self.budget - SURE * np.sqrt(found.variance)
        goal = ease * max(room, self.budget / 4)
        have, want = self.have.ravel(), self.want.ravel()
        allotted = allocate(found.variances, have[found.sampled], found.survey, goal)
        want[found.sampled] = np.minimum(allotted.pixels, have[found.sampled] + LEAP)
        looks = np.flatnonzero(~self.shown.ravel())
        levels = allotted.strata[self.strata.ravel()[looks]]
        want[looks] = np.minimum(levels, np.maximum(have[looks], SAMPLED) + LEAP)
        self.shown.ravel()[looks[levels > 0]] = True

    def _question(self, found: Findings, ease: float) -> None:
        """More of probes whose strata leave the error uncertain: more samples, or more of them."""
        survey = found.survey
        unsure = survey.unsure((ease * DOUBT * self.budget) ** 2)
        crowded = unsure & (self.chances >= 1)
        self.shown |= crowded[self.strata]
        most = np.where(survey.sizes > MANY, MOST_PROBED, 1.0)
        noisy = unsure & (survey.noise**2 > survey.uncertain**2 / 2) & (self._closeness(found) < CLOSEST)
        have, want, shown = self.have.ravel(), self.want.ravel(), self.shown.ravel()
        again = found.probes[noisy[self.strata.ravel()[found.probes]] & ~shown[found.probes]]
        want[again] = np.minimum(have[again] + 2, CLOSEST)
        rarer = unsure & ~noisy & (self.chances < most)
        self.chances[rarer] = np.minimum(2 * self.chances, most)[rarer]
        fresh = (self._probes() | self.shown) & (self.have < SAMPLED) & (self.want < SAMPLED)
        self.want[fresh] = PROBED

    def _closeness(self, found: Findings) -> Integers:
        """Least level of the probes of each stratum."""
        levels = np.full(strata.COUNT, HIGHEST)
        np.minimum.at(levels, self.strata.ravel()[found.probes], self.have.ravel()[found.probes])
        return levels

    def _suspect(self, found: Findings) -> None:
        """Sample all pixels near a probe that found what first looks had missed.

        They become a stratum of their own, so that what one probe found is not taken to be everywhere.
        """
        kinds = self.strata.ravel() // strata.STEPS
        typical = found.survey.errors[self.strata.ravel()[found.probes]]
        odd = found.errors > FIND * np.maximum(self.target**2, typical)
        odd &= (kinds[found.probes] <= strata.EVEN) & ~self._fine().ravel()[found.probes]
        near = np.zeros(self.have.shape, dtype=bool)
        near.ravel()[found.probes[odd]] = True
        near.ravel()[self._followed(found)] = True
        near = spread(near, COARSEST // 2) & ~self.shown
        self.strata[near] = self.strata[near] % strata.STEPS + strata.STEPS * strata.SUSPECT
        self.shown |= near
        self.want[near] = np.maximum(self.have[near], SAMPLED) + 2

    def _followed(self, found: Findings) -> Integers:
        """Suspects that found something themselves: what is long and thin goes on beyond them."""
        suspects = found.sampled[self.strata.ravel()[found.sampled] // strata.STEPS == strata.SUSPECT]
        both = np.clip(self.halves.reshape(HALVES, 3, -1)[:, :, suspects], 0, 1)
        apart = both - np.clip(self.values.reshape(3, -1)[:, suspects], 0, 1)
        return suspects[(apart[0] * apart[1]).mean(axis=0) > FIND * self.target**2]

    def _show_probed(self) -> None:
        """Show the samples of strata most of whose pixels are probes.

        What few samples say of a look is mostly nothing and seldom much; of themselves they know more.
        """
        self.shown |= (self.chances >= MOSTLY)[self.strata]
