"""The picture so far with its samples, labels and error.

All sums are formed in the order of pixels, so that nothing depends on tiles.
"""

from dataclasses import dataclass, fields
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.adaptive import strata
from renderer.adaptive.guides import Around
from renderer.adaptive.labels import Labels
from renderer.adaptive.lattice import NODE, Axes, Picture, first_stride
from renderer.adaptive.levels import (
    COUNTS,
    COVERAGES,
    COVERED,
    PREVIEWED,
    RAY_PRICE,
    SAMPLED,
    Levels,
)
from renderer.adaptive.requests import AIM_FACTOR, FIRST_AIM, LevelRequest, Samples
from renderer.adaptive.target_plan import TargetPlan
from renderer.adaptive.uncertainty import ErrorEstimate
from renderer.film import Image
from renderer.halves import HALVES
from renderer.interaction import MISS
from renderer.math.arrays import Floats, Integers, Masks, add, put, taken
from schemas.tiles import Tile


class State(Enum):
    """The kind of the next pass; the package's docstring draws how they follow each other."""

    LATTICE = "lattice"
    PROBES = "probes"
    SAMPLE = "sample"
    DONE = "done"


@dataclass(slots=True, eq=False)
class Estimate:
    """A picture of target quality in progress.

    A pass brings the pixels from the levels that they `have` to those that it wants (`levels`). Between
    passes `controller.advance` decides.

    Attributes
    ----------
    plan : TargetPlan
    values : (3, H, W) float32
        Radiance without samples: pilot samples, values interpolated between nodes, and at borders the means
        of what rays hit.
    pilots : (3, H, W) float32
        The pilot samples alone, once border pixels show something else.
    labels : (H, W) int32
        Of the pilot samples' hits.
    colors : (3, H, W) float32
        Texture colours there, 1 without a texture.
    others : (3, H, W) float32
        Radiance of what border pixels show and no pilot sample around has hit; NaN before they are covered.
    controlled : (H, W) bool
        Pixels whose samples are differences from a control variate with the mean `values`.
    contrasts : (H, W) float32
        Expected squared error of border pixels if one ray estimated the coverage.
    coverage_variance : (H, W) float32
        Measured squared standard error of border pixels due to their coverage, mean over channels.
    expected_error : (H, W) float32
        Expected squared error, mean over channels: at borders of the brightness of their parts, between nodes
        of interpolation, and of pilot samples that shade fine texture at a few points.
    have, want : (H, W) uint8
    coverage, cover : (H, W) uint8
        Numbers of `levels.COVERAGES`: present, and requested.
    halves : (2, 3, H, W) float64
        Means of either half of the samples.
    squares : (H, W) float64
        Sum over the samples of squares about their mean, mean over channels.
    shown : (H, W) bool
        Pixels that show their samples, in place of their pilot sample or an interpolated value.
    axes : (H, W) uint8
        Axis along which pixels that are not shown are interpolated (`lattice`).
    strata : (H, W) int64
    probe_probability : (strata.COUNT,) float64
        Share of the pixels of each stratum that are probes.
    state : State
        Of the next pass.
    stride : int
        Pixels between the nodes of the lattice, those of the next pass included.
    aims : int
        Times that the error aimed at was halved, where there is a time limit.
    predicted_rays : int
        Camera rays of all passes to come.
    error : ErrorEstimate or None
        None before the probes.
    """

    plan: TargetPlan
    values: Picture
    pilots: Picture
    labels: Labels
    colors: Picture
    others: Picture
    controlled: Masks
    contrasts: NDArray[np.float32]
    coverage_variance: NDArray[np.float32]
    expected_error: NDArray[np.float32]
    have: Levels
    want: Levels
    coverage: Levels
    cover: Levels
    halves: Floats
    squares: Floats
    shown: Masks
    axes: Axes
    strata: Integers
    probe_probability: Floats
    state: State
    stride: int
    aims: int = 0
    predicted_rays: int = 0
    error: ErrorEstimate | None = None

    @classmethod
    def begin(cls, plan: TargetPlan) -> "Estimate":
        """The empty picture with the first pass requested: pilot samples or samples on a coarse lattice."""
        size = plan.height, plan.width
        want = LevelRequest.first(plan, Tile(0, 0, 0, plan.width, plan.height)).want
        sampled = want >= SAMPLED
        return cls(
            plan=plan,
            values=np.zeros((3, *size), dtype=np.float32),
            pilots=np.zeros((3, *size), dtype=np.float32),
            labels=np.full(size, MISS, dtype=np.int32),
            colors=np.ones((3, *size), dtype=np.float32),
            others=np.full((3, *size), np.nan, dtype=np.float32),
            controlled=np.zeros(size, dtype=bool),
            contrasts=np.zeros(size, dtype=np.float32),
            coverage_variance=np.zeros(size, dtype=np.float32),
            expected_error=np.zeros(size, dtype=np.float32),
            have=np.zeros(size, dtype=np.uint8),
            coverage=np.zeros(size, dtype=np.uint8),
            cover=np.zeros(size, dtype=np.uint8),
            want=want,
            halves=np.zeros((HALVES, 3, *size)),
            squares=np.zeros(size),
            shown=sampled,
            axes=np.full(size, NODE, dtype=np.uint8),
            strata=np.full(size, strata.STEPS_PER_KIND - 1),
            probe_probability=np.zeros(strata.COUNT),
            state=State.LATTICE,
            stride=first_stride(plan.document.camera),
        )

    @classmethod
    def restored(cls, plan: TargetPlan, arrays: dict[str, NDArray[Any]]) -> "Estimate":
        """The estimate that gave `arrays`; ValueError if they are not those of an estimate."""
        arrays = _of_first_release(arrays)
        odd = {*_ARRAYS, *_COUNTERS, STATE} ^ (arrays.keys() - {ERROR})
        if odd:
            raise ValueError(f"Not the arrays of an estimate: {', '.join(sorted(odd))} missing or unknown.")
        known: dict[str, Any] = {name: arrays[name] for name in _ARRAYS}
        known |= {name: int(arrays[name]) for name in _COUNTERS}
        error = ErrorEstimate.restored(arrays[ERROR]) if ERROR in arrays else None
        return cls(plan=plan, state=State(arrays[STATE].item()), error=error, **known)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The whole state but for the plan."""
        known = {name: np.asarray(getattr(self, name)) for name in (*_ARRAYS, *_COUNTERS)}
        known[STATE] = np.array(self.state.value)
        return known if self.error is None else known | {ERROR: self.error.array()}

    @property
    def piloted(self) -> bool:
        """Whether nodes are pilot samples, which have no noise; through a lens they are sampled."""
        return self.plan.pilot is not None

    @property
    def coarsest(self) -> int:
        """Pixels between the nodes of the first lattice."""
        return first_stride(self.plan.document.camera)

    @property
    def target(self) -> float:
        """The target error."""
        return self.plan.quality.error

    @property
    def confidence(self) -> float:
        """The share of such pictures that are to keep the target."""
        return self.plan.quality.confidence

    @property
    def aim(self) -> float:
        """The error that the next pass aims at: coarse first under a time limit, so that it falls fast."""
        if self.plan.quality.time_limit is None:
            return self.target
        return float(max(self.target, FIRST_AIM * AIM_FACTOR**self.aims))

    @property
    def budget(self) -> float:
        """Sum of squared errors, mean over channels, at which the aim is reached."""
        return self.aim**2 * self.have.size

    def take(self, tile: Tile, samples: Samples) -> None:
        """Merge the samples of a tile. The order of tiles does not matter."""
        part = np.s_[tile.y0 : tile.y1, tile.x0 : tile.x1]
        have, want = self.have[part], self.want[part]
        requested = self.requested.part(tile)
        previewed = self._numbers(tile, requested.previewed)
        put(self.values.reshape(3, -1), previewed, samples.pilots)
        self.labels.ravel()[previewed] = samples.labels
        put(self.colors.reshape(3, -1), previewed, samples.colors)
        self.expected_error.ravel()[previewed] = samples.shading_errors
        covered = self._numbers(tile, requested.covered)
        self._cover(covered, samples)
        self._add(self._numbers(tile, requested.sampled), samples)
        np.maximum(have, want, out=have)
        have[requested.covered & (have < COVERED)] = COVERED
        np.maximum(self.coverage[part], self.cover[part], out=self.coverage[part])

    def _numbers(self, tile: Tile, chosen: Masks) -> Integers:
        """Numbers in the picture of the pixels chosen (h, w) from a tile, in their order."""
        rows, columns = np.divmod(np.flatnonzero(chosen), tile.width)
        return (rows + tile.y0) * self.have.shape[1] + columns + tile.x0

    def _cover(self, pixels: Integers, samples: Samples) -> None:
        """Change the control variates of border pixels (m,), and their samples, which are differences."""
        values, others = self.values.reshape(3, -1), self.others.reshape(3, -1)
        change = (samples.covers - taken(values, pixels)) * (self.have.ravel()[pixels] >= SAMPLED)
        for half in self.halves.reshape(HALVES, 3, -1):
            add(half, pixels, change)
        put(values, pixels, samples.covers)
        put(others, pixels, samples.others)
        self.coverage_variance.ravel()[pixels] = samples.coverage_variance
        self.controlled.ravel()[pixels] = True

    def _add(self, pixels: Integers, samples: Samples) -> None:
        """Merge new samples of pixels (m,) with earlier ones (Chan, Golub, LeVeque 1979)."""
        before, after = COUNTS[self.have.ravel()[pixels]], COUNTS[self.want.ravel()[pixels]]
        share = (after - before) / after
        halves = self.halves.reshape(HALVES, 3, -1)
        known = taken(self.values.reshape(3, -1), pixels) * self.controlled.ravel()[pixels]
        apart = samples.halves + known - taken(halves, pixels)
        self.squares.ravel()[pixels] += (
            samples.squares + (apart.mean(axis=0) ** 2).mean(axis=0) * before * share
        )
        for half, change in zip(halves, apart * share, strict=True):
            add(half, pixels, change)

    def image(self) -> Image:
        """The picture so far, (H, W, 3) float32, linear."""
        return self.part(Tile(0, 0, 0, self.have.shape[1], self.have.shape[0]))

    def part(self, tile: Tile) -> Image:
        """The picture so far in a tile, (h, w, 3) float32, linear.

        Before the pilot samples have reached every pixel, each node of their lattice fills its square.
        """
        stride = self.stride
        rows, columns = np.arange(tile.y0, tile.y1)[:, None], np.arange(tile.x0, tile.x1)
        y: Any = rows // stride * stride
        x: Any = columns // stride * stride
        if stride == 1:
            # Slices of all pixels: an index for each of them takes ten times as long.
            y, x = slice(tile.y0, tile.y1), slice(tile.x0, tile.x1)
        picture = self.values[:, y, x].copy()
        sampled = self.shown[y, x] & (self.have[y, x] >= SAMPLED)
        if sampled.any():
            # Differences from a control variate may leave a negative sum in the dark.
            picture[:, sampled] = np.maximum(self.halves[:, :, y, x][:, :, sampled].mean(axis=0), 0)
        return np.ascontiguousarray(picture.transpose(1, 2, 0))

    def needs_pilots(self) -> bool:
        """Whether the pass needs the pilot samples around its pixels."""
        return self.requested.needs_pilots(self.plan)

    @property
    def around(self) -> Around:
        """The pilot samples that tiles get."""
        return self.pilots, self.labels, self.colors, self.others

    @property
    def requested(self) -> LevelRequest:
        """Levels that the pixels have and that the pass wants."""
        return LevelRequest(self.have, self.want, self.coverage, self.cover)

    def samples(self, pixels: Integers) -> Integers:
        """Camera samples of pixels (n,)."""
        return np.asarray(COUNTS[self.have.ravel()[pixels]])

    def variances(self, pixels: Integers) -> Floats:
        """Variances of single samples of sampled pixels (n,), mean over channels."""
        return np.asarray(self.squares.ravel()[pixels] / (self.samples(pixels) - 1))

    def counts(self) -> Integers:
        """Camera rays through each pixel, (H, W), those of probes included."""
        return np.asarray(COUNTS[self.have] + COVERAGES[self.coverage] + (self.have == PREVIEWED))

    def rays_wanted(self) -> int:
        """Camera rays of the next pass."""
        _, samples, covers = self._wanted()
        return int(samples.sum() + covers.sum())

    def work_wanted(self) -> float:
        """Cost of the next pass, in camera samples."""
        _, samples, covers = self._wanted()
        return float(samples.sum() + RAY_PRICE * covers.sum())

    def work_in_cells(self, side: int) -> Floats:
        """Cost in each square of `side` by `side` pixels, (a, b)."""
        height, width = (-(-size // side) for size in self.have.shape)
        pixels, samples, covers = self._wanted()
        rows, columns = np.divmod(pixels, self.have.shape[1])
        cells = rows // side * width + columns // side
        work = np.bincount(cells, samples + RAY_PRICE * covers, height * width)
        return work.astype(np.float64).reshape(height, width)

    def _wanted(self) -> tuple[Integers, Integers, Integers]:
        """Pixels (n,) of the next pass, and the samples and coverage rays of each."""
        have, want, coverage, cover = (
            map_.ravel() for map_ in (self.have, self.want, self.coverage, self.cover)
        )
        pixels = np.flatnonzero(self.requested.rising)
        have, want, cover = have[pixels], want[pixels], cover[pixels] * (cover > coverage)[pixels]
        samples = np.maximum(COUNTS[want] - COUNTS[have], 0) + ((want == PREVIEWED) & (have < PREVIEWED))
        return pixels, samples, COVERAGES[cover]


def _of_first_release(arrays: dict[str, Any]) -> dict[str, Any]:
    """Convert arrays that version 0.1.0 has stored.

    It showed the samples of all strata, had more states, and others counted as 0 in the control variate.
    """
    arrays = {_RENAMED.get(name, name): arrays[name] for name in arrays.keys() - _DROPPED}
    if "known" not in arrays:
        return arrays
    covered, known = arrays["coverage"] > 0, arrays.pop("known")
    if arrays[STATE].item() in {"preview", "borders"}:
        arrays[STATE] = np.array(State.LATTICE.value)
    return arrays | {
        "others": np.where(covered, np.float32(0), np.full_like(known, np.nan)),
        "controlled": covered | known.any(axis=0),
        "values": np.where(covered, known, arrays["values"]),
    }


STATE, ERROR = "state", "error"
"""Names of the arrays of an estimate's state, and of its error where that is known."""

_COUNTERS = ("stride", "aims", "predicted_rays")

_ARRAYS = tuple(item.name for item in fields(Estimate) if item.name not in {"plan", STATE, ERROR, *_COUNTERS})

_RENAMED = {
    "spread": "coverage_variance",
    "doubts": "expected_error",
    "ways": "axes",
    "outlook": "predicted_rays",
}
"""Stored names of version 0.1.0."""

_DROPPED = {"rounds", "kept"}
"""Arrays of version 0.1.0 that nothing needs."""
