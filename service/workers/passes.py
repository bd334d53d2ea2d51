"""What a worker does for pictures of target quality: sample the tiles of a pass, and merge them."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import partial
from typing import Any

import numpy as np

from renderer import film
from renderer.adaptive import Estimate, Samples
from renderer.adaptive.driver import Driver
from renderer.adaptive.findings import sample_layers
from renderer.adaptive.forecast import Forecast, usual_prices
from renderer.adaptive.guides import Surroundings, packed, unpacked
from renderer.adaptive.requests import LevelRequest, first_levels, tile_request
from renderer.adaptive.samples import preview
from renderer.adaptive.target_plan import TargetPlan
from renderer.adaptive.tile_rendering import render_request
from renderer.adaptive.time_limits import OutOfTimeError, TimeLimit
from renderer.images import files as image_files
from service.storage.tiles import Pixels, TileStore
from service.workers import layers
from service.workers.tasks import AdvanceDone, AdvanceTask, Interrupted, SampleTask, TileDone, numbered


@dataclass(frozen=True)
class PassWorker:
    """Executes tasks of jobs of target quality; all state of a job is in the store."""

    store: TileStore
    workers: int

    def sample(self, plan: TargetPlan, task: SampleTask, until: float | None) -> TileDone | Interrupted:
        """Render what the pass wants in a tile, unless the job's time is spent before it is finished.

        Parameters
        ----------
        until
            When that is, by `time.monotonic` here.
        """
        begun = time.process_time()
        levels, before = self._levels(plan, task)
        limit = None if until is None else TimeLimit(until, task.ray_seconds)
        around = partial(self._around, task)
        request = tile_request(plan, task.tile, levels, around, limit, first=not task.merged)
        try:
            samples = render_request(plan, request)
        except OutOfTimeError:
            return Interrupted(late=True)
        kept = {name: value for name, value in _members(samples) if isinstance(value, np.ndarray)}
        kept["seconds"] = np.array(samples.cpu_seconds)
        self.store.put_samples(task.job, task.pass_.index, task.tile, task.attempt, kept)
        if request.records:
            self._put_layers(task, samples)
        pixels = preview(task.tile, samples, levels, before)
        crc32 = self.store.put_tile(task.job, task.tile, task.pass_, task.attempt, pixels)
        return TileDone(crc32, samples.counts, time.process_time() - begun, samples.work)

    def _put_layers(self, task: SampleTask, samples: Samples) -> None:
        """Keep what the centres of pixels show."""
        kept = {name: record for name, record in samples.layers.items() if layers.of_centres(name)}
        self.store.put_layers(task.job, task.tile, task.pass_, task.attempt, kept)

    def _levels(self, plan: TargetPlan, task: SampleTask) -> tuple[LevelRequest, Pixels]:
        """Levels that the pixels of a tile have and that are requested, and its picture so far."""
        part = np.s_[task.tile.y0 : task.tile.y1, task.tile.x0 : task.tile.x1]
        if not task.merged:
            want = first_levels(plan, task.tile)
            return LevelRequest.first(want), np.zeros((*want.shape, 3), np.float32)
        before = task.job, task.pass_.index - 1, task.merged
        levels = LevelRequest(*np.array(self.store.get_map(*before, "levels")[:, *part]))
        return levels, np.array(self.store.get_map(*before, "picture")[part])

    def _around(self, task: SampleTask) -> Surroundings:
        """Pilot samples around a tile."""
        return unpacked(task.tile, self.store.get_map(task.job, task.pass_.index - 1, task.merged, "pilots"))

    def advance(self, plan: TargetPlan, task: AdvanceTask) -> AdvanceDone:
        """Merge a pass, and leave for the next one what it needs, or the final picture."""
        begun = time.process_time()
        driver = self._driver(plan, task)
        estimate, continues = driver.estimate, driver.end_pass(last=task.last)
        image, sha256, written = estimate.image(), None, 0
        if continues:
            self._keep(estimate, task, image)
        else:
            sha256, written = self._keep_final(estimate, task, image)
        self.store.drop_passes_before(task.job, task.pass_.index - 1)
        expected = driver.forecast() if continues else Forecast(next=0.0, later=0.0)
        return AdvanceDone(
            tiles=tuple(numbered(driver.tiles())) if continues else (),
            samples=estimate.rays_wanted() if continues else 0,
            next_seconds=expected.next,
            later_seconds=expected.later,
            prices=dict(driver.prices),
            ray_seconds=driver.ray_seconds,
            error=estimate.error.document() if estimate.error else None,
            numerics={"non_finite": film.non_finite(image), "clamped": film.clamped([(task.pass_, image)])},
            cpu_seconds=time.process_time() - begun,
            sha256=sha256,
            bytes=written,
        )

    def _driver(self, plan: TargetPlan, task: AdvanceTask) -> Driver:
        """Return the driver of the picture as the pass before left it, with the tiles of this one."""
        if task.merged:
            arrays = self.store.get_state(task.job, task.pass_.index - 1, task.merged)
            estimate, prices = Estimate.restored(plan, arrays), task.prices or usual_prices(plan)
            driver = Driver(estimate, prices, self.workers, task.tile_size)
        else:
            driver = Driver.begin(plan, self.workers, task.tile_size)
        found = self.store.get_samples(task.job, task.pass_.index, task.parts)
        for part, arrays in zip(task.parts, found, strict=True):
            driver.take(part.tile, _samples_of(arrays))
        return driver

    def _keep(self, estimate: Estimate, task: AdvanceTask, picture: Pixels) -> None:
        place = task.job, task.pass_.index, task.attempt
        self.store.put_state(*place, estimate.arrays())
        self.store.put_map(*place, "levels", estimate.requested.stacked())
        self.store.put_map(*place, "picture", picture)
        if estimate.needs_pilots():
            self.store.put_map(*place, "pilots", packed(estimate.around))

    def _keep_final(self, estimate: Estimate, task: AdvanceTask, picture: Pixels) -> tuple[str, int]:
        """Keep the final picture and its layers; return the picture's SHA-256, and the bytes of all."""
        size = picture.shape[0], picture.shape[1]
        buffers = layers.composed(self.store, task.job, size, task.layers, task.recorded)
        written = 0
        for name, sheet in (buffers | sample_layers(estimate, task.layers)).items():
            content = image_files.encode_layer(sheet)
            written += self.store.put_final(task.job, task.attempt, layers.file_name(name), content)
        data = image_files.encode_npy(picture)
        written += self.store.put_final(task.job, task.attempt, "image.npy", data)
        return hashlib.sha256(data).hexdigest(), written


def _samples_of(arrays: dict[str, Any]) -> Samples:
    """Make samples of what was kept of them."""
    seconds = float(arrays.pop("seconds"))
    if "known" in arrays:
        # Of version 0.1.0, for which others counted as 0, and which measured doubts.
        arrays["covers"] = arrays.pop("known")
        arrays["others"] = np.zeros_like(arrays["covers"])
        del arrays["doubts"]
    return Samples(**arrays, counts={}, work={}, cpu_seconds=seconds)


def _members(samples: Samples) -> Iterator[tuple[str, object]]:
    return ((item.name, getattr(samples, item.name)) for item in fields(samples))
