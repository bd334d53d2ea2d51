"""Worker side of target quality: sample the tiles of a pass, and merge them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import partial
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer import film
from renderer.adaptive import Estimate, Samples
from renderer.adaptive.driver import Driver
from renderer.adaptive.error_statistics import sample_layers
from renderer.adaptive.forecast import UNKNOWN, usual_prices
from renderer.adaptive.guides import Surroundings, packed, unpacked
from renderer.adaptive.requests import LevelRequest, TileRequest, preview
from renderer.adaptive.target_plan import TargetPlan
from renderer.adaptive.tile_rendering import render_request
from renderer.adaptive.time_limits import TimeLimit
from renderer.integrator import OutOfTimeError
from service.storage.checksums import Checksum, is_lost
from service.storage.tiles import PassMap, Pixels, StoredTile, TileStore, damaged_steps
from service.workers import layers
from service.workers.tasks import (
    AdvanceDone,
    AdvanceTask,
    InputDamaged,
    Interrupted,
    Preempted,
    SampleTask,
    TileDone,
    numbered,
)


@dataclass(frozen=True)
class PassWorker:
    """Executes tasks of jobs of target quality; all state of a job is in the store."""

    store: TileStore
    workers: int
    slice_seconds: float

    def sample(
        self, plan: TargetPlan, task: SampleTask, until: float, begun: float
    ) -> TileDone | Preempted | Interrupted:
        """Render what the pass wants in a tile, unless it takes longer than a time slice.

        Parameters
        ----------
        until
            When the job's time is spent, by `time.monotonic` here.
        begun
            When the task began, by `time.process_time`.
        """
        levels, before = self._levels(plan, task)
        around, limit = partial(self._around, task), self._limit(task, until)
        request = TileRequest.of(plan, task.tile, levels, around, limit, first=not task.merged)
        try:
            samples = render_request(plan, request)
        except OutOfTimeError:
            spent = time.process_time() - begun
            return Interrupted(late=True) if time.monotonic() >= until else Preempted(spent)
        kept = {name: value for name, value in _members(samples) if isinstance(value, np.ndarray)}
        kept["seconds"] = np.array(samples.cpu_seconds)
        self.store.put_samples(task.job, task.pass_.index, task.tile, task.attempt, kept)
        if request.records:
            self._put_layers(task, samples)
        pixels = preview(task.tile, samples, levels, before)
        crc32 = self.store.put_tile(task.job, task.tile, task.pass_, task.attempt, pixels)
        return TileDone(crc32, samples.counts, time.process_time() - begun, samples.work)

    def _limit(self, task: SampleTask, until: float) -> TimeLimit:
        """Return when a tile is given up: one of a single pixel cannot be cut into smaller ones."""
        is_pixel = task.tile.width * task.tile.height == 1
        over = inf if is_pixel else time.monotonic() + self.slice_seconds
        return TimeLimit(min(until, over), task.ray_seconds)

    def _put_layers(self, task: SampleTask, samples: Samples) -> None:
        """Store the layers of pixel centres."""
        kept = {name: record for name, record in samples.layers.items() if layers.of_centres(name)}
        self.store.put_layers(task.job, task.tile, task.pass_, task.attempt, kept)

    def _levels(self, plan: TargetPlan, task: SampleTask) -> tuple[LevelRequest, Pixels]:
        """Levels that the pixels of a tile have and that are requested, and its picture so far."""
        part = np.s_[task.tile.y0 : task.tile.y1, task.tile.x0 : task.tile.x1]
        if not task.merged:
            first = LevelRequest.first(plan, task.tile)
            return first, np.zeros((*first.want.shape, 3), np.float32)
        levels = LevelRequest(*np.array(self._map(task, "levels")[:, *part]))
        return levels, np.array(self._map(task, "picture")[part])

    def _around(self, task: SampleTask) -> Surroundings:
        """Pilot samples around a tile."""
        return unpacked(task.tile, self._map(task, "pilots"))

    def _map(self, task: SampleTask, kind: PassMap) -> NDArray[Any]:
        """Open the files that merging the previous pass left."""
        return self.store.get_map(task.job, task.pass_.index - 1, task.merged, kind, task.checksums)

    def advance(self, plan: TargetPlan, task: AdvanceTask) -> AdvanceDone:
        """Merge a pass, and store the state for the next one, or the final picture."""
        begun = time.process_time()
        driver = self._driver(plan, task)
        estimate, continues = driver.estimate, driver.end_pass(last=task.last)
        image, sha256 = estimate.image(), None
        if continues:
            checksums = self._keep(estimate, task, image)
        else:
            sha256, checksums = self._keep_final(estimate, task, image)
        self.store.drop_passes_before(task.job, task.pass_.index - 1)
        return AdvanceDone(
            tiles=tuple(numbered(driver.tiles())) if continues else (),
            samples=estimate.rays_wanted() if continues else 0,
            expected=driver.forecast(time.process_time() - begun) if continues else UNKNOWN,
            prices=dict(driver.prices),
            ray_seconds=driver.ray_seconds,
            error=estimate.error.document() if estimate.error else None,
            numerics={"non_finite": film.non_finite(image), "clamped": film.clamped([(task.pass_, image)])},
            cpu_seconds=time.process_time() - begun,
            sha256=sha256,
            checksums=checksums,
        )

    def _driver(self, plan: TargetPlan, task: AdvanceTask) -> Driver:
        """Return the driver of the picture after the previous pass, with the tiles of this one."""
        if task.merged:
            arrays = self._state(task)
            estimate, prices = Estimate.restored(plan, arrays), usual_prices(plan) | (task.prices or {})
            driver = Driver(estimate, prices, self.workers, task.tile_size)
        else:
            driver = Driver.begin(plan, self.workers, task.tile_size)
        found = self.store.get_samples(task.job, task.pass_.index, task.parts)
        for part, arrays in zip(task.parts, found, strict=True):
            driver.take(part.tile, _samples_of(arrays))
        return driver

    def _state(self, task: AdvanceTask) -> dict[str, Any]:
        """Read the estimate after the pass before."""
        return self.store.get_state(task.job, task.pass_.index - 1, task.merged, task.checksums)

    def _keep(self, estimate: Estimate, task: AdvanceTask, picture: Pixels) -> dict[str, Checksum]:
        """Store the state for the next pass; return the checksums of its files."""
        place = task.job, task.pass_.index, task.attempt
        maps: dict[PassMap, NDArray[Any]] = {"levels": estimate.requested.stacked(), "picture": picture}
        if estimate.needs_pilots():
            maps["pilots"] = packed(estimate.around)
        checksums = {**self.store.put_state(*place, estimate.arrays())}
        for kind, array in maps.items():
            checksums |= self.store.put_map(*place, kind, array)
        return checksums

    def _keep_final(
        self, estimate: Estimate, task: AdvanceTask, picture: Pixels
    ) -> tuple[str, dict[str, Checksum]]:
        """Keep the final picture and its layers; return the picture's SHA-256, and the checksums of all."""
        size = picture.shape[0], picture.shape[1]
        buffers = layers.composed(self.store, task.job, size, task.layers, task.recorded)
        sheets = buffers | sample_layers(estimate, task.layers)
        return layers.put_final(self.store, task.job, task.attempt, picture, sheets)

    def damage(self, task: AdvanceTask) -> InputDamaged:
        """Find the files that merging could not read."""

        def samples(part: StoredTile) -> object:
            return next(self.store.get_samples(task.job, task.pass_.index, [part]))

        steps = damaged_steps(task.parts, samples)
        steps += layers.damaged(self.store, task.job, task.layers, task.recorded)
        return InputDamaged(tuple(steps), merged=bool(task.merged) and is_lost(partial(self._state, task)))


def _samples_of(arrays: dict[str, Any]) -> Samples:
    """Restore samples from their stored arrays."""
    seconds = float(arrays.pop("seconds"))
    if "known" in arrays:
        # Estimates of version 0.1.0 have no others, and other names.
        arrays |= {"coverage_variance": arrays.pop("spread"), "shading_errors": arrays.pop("residues")}
        arrays["covers"] = arrays.pop("known")
        arrays["others"] = np.zeros_like(arrays["covers"])
        del arrays["doubts"]
    return Samples(**arrays, counts={}, work={}, cpu_seconds=seconds)


def _members(samples: Samples) -> Iterator[tuple[str, object]]:
    return ((item.name, getattr(samples, item.name)) for item in fields(samples))
