"""What a worker does for pictures of target quality: sample the tiles of a pass, and merge them."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from renderer import RenderPlan, film
from renderer.adaptive import Estimate, Samples
from renderer.adaptive.adaptive_render import records_centres
from renderer.adaptive.estimate import first_levels
from renderer.adaptive.forecast import Forecast, Prices, forecast, kind_of, measured_prices, usual_prices
from renderer.adaptive.guides import Surroundings, packed, unpacked
from renderer.adaptive.partition import pass_tiles
from renderer.adaptive.requests import LevelRequest, TileRequest
from renderer.adaptive.samples import preview
from renderer.adaptive.tile_rendering import render_request
from renderer.adaptive.time_limits import OutOfTimeError, TimeLimit
from renderer.images import files as image_files
from schemas.tiles import Tile
from service.storage.passes import PassStore
from service.storage.tiles import Pixels, TileStore
from service.workers import layers
from service.workers.pass_tiles import numbered
from service.workers.tasks import AdvanceDone, AdvanceTask, Interrupted, SampleTask, TileDone


@dataclass(frozen=True)
class PassWorker:
    """Executes tasks of jobs of target quality; all that it knows of a job lies in the store."""

    store: TileStore
    passes: PassStore
    workers: int

    def sample(self, plan: RenderPlan, task: SampleTask) -> TileDone | Interrupted:
        """Render what the pass wants in a tile, unless the job's time is spent before it is finished."""
        begun = time.process_time()
        levels, before = self._levels(plan, task)
        around = self._around(task) if task.merged and levels.needs_pilots(plan) else None
        records = not task.merged and records_centres(plan)
        limit = None if task.until is None else TimeLimit(task.until, task.ray_seconds)
        try:
            samples = render_request(plan, TileRequest(task.tile, levels, around, records, limit))
        except OutOfTimeError:
            return Interrupted(late=True)
        kept = {name: value for name, value in _members(samples) if isinstance(value, np.ndarray)}
        kept["seconds"] = np.array(samples.cpu_seconds)
        self.passes.put_samples(task.job, task.pass_.index, task.tile, task.attempt, kept)
        if records:
            self._put_layers(task, samples)
        pixels = preview(task.tile, samples, levels, before)
        crc32 = self.store.put_tile(task.job, task.tile, task.pass_, task.attempt, pixels)
        return TileDone(crc32, samples.counts, time.process_time() - begun, samples.work)

    def _put_layers(self, task: SampleTask, samples: Samples) -> None:
        """Keep what the centres of pixels show."""
        kept = {name: record for name, record in samples.layers.items() if layers.of_centres(name)}
        self.store.put_layers(task.job, task.tile, task.pass_, task.attempt, kept)

    def _levels(self, plan: RenderPlan, task: SampleTask) -> tuple[LevelRequest, Pixels]:
        """Levels that the pixels of a tile have and that are wanted, and the tile as it looks."""
        part = np.s_[task.tile.y0 : task.tile.y1, task.tile.x0 : task.tile.x1]
        if not task.merged:
            want = first_levels(plan, task.tile)
            return LevelRequest.first(want), np.zeros((*want.shape, 3), np.float32)
        before = task.job, task.pass_.index - 1, task.merged
        levels = LevelRequest(*np.array(self.passes.get_levels(*before)[:, *part]))
        return levels, np.array(self.passes.get_picture(*before)[part])

    def _around(self, task: SampleTask) -> Surroundings:
        """Pilot samples around a tile."""
        return unpacked(task.tile, self.passes.get_pilots(task.job, task.pass_.index - 1, task.merged))

    def advance(self, plan: RenderPlan, task: AdvanceTask) -> AdvanceDone:
        """Merge a pass, and leave for the next one what it needs, or the final picture."""
        begun = time.process_time()
        estimate, prices = self._state(plan, task)
        goes_on = not task.last and _advanced(estimate)
        error = estimate.settle() if task.last else estimate.error
        image, sha256 = estimate.image(), None
        if goes_on:
            self._keep(estimate, task, image)
        else:
            sha256 = self._keep_final(estimate, task, image)
        self.passes.drop_before(task.job, task.pass_.index - 1)
        expected = forecast(estimate, prices) if goes_on else Forecast(next=0.0, later=0.0)
        return AdvanceDone(
            tiles=self._tiles(estimate, prices, task) if goes_on else (),
            samples=estimate.rays_wanted() if goes_on else 0,
            next_seconds=expected.next,
            later_seconds=expected.later,
            prices=prices,
            ray_seconds=prices[kind_of(estimate)],
            error=error.document() if error else None,
            numerics={"non_finite": film.non_finite(image), "clamped": film.clamped([(task.pass_, image)])},
            cpu_seconds=time.process_time() - begun,
            sha256=sha256,
        )

    def _tiles(self, estimate: Estimate, prices: Prices, task: AdvanceTask) -> tuple[Tile, ...]:
        """Give the tiles in which the next pass has something to do."""
        found = pass_tiles(estimate, prices, self.workers, task.tile_size, records=False)
        return tuple(numbered(found))

    def _state(self, plan: RenderPlan, task: AdvanceTask) -> tuple[Estimate, dict[str, float]]:
        """Give what is known with the tiles of the pass, and what its rays have cost."""
        if not task.merged:
            estimate = Estimate.begin(plan)
        else:
            arrays = self.passes.get_state(task.job, task.pass_.index - 1, task.merged)
            estimate = Estimate.restored(plan, arrays)
        kind, rays, seconds = kind_of(estimate), estimate.rays_wanted(), 0.0
        found = self.passes.get_samples(task.job, task.pass_.index, task.parts)
        for part, arrays in zip(task.parts, found, strict=True):
            seconds += float(arrays.pop("seconds"))
            estimate.take(part.tile, _samples_of(arrays))
        return estimate, measured_prices(
            task.prices or usual_prices(plan), kind, rays, seconds, len(task.parts)
        )

    def _keep(self, estimate: Estimate, task: AdvanceTask, picture: Pixels) -> None:
        place = task.job, task.pass_.index, task.attempt
        self.passes.put_state(*place, estimate.arrays())
        self.passes.put_levels(*place, estimate.requested.stacked())
        self.passes.put_picture(*place, picture)
        if estimate.needs_pilots():
            self.passes.put_pilots(*place, packed(estimate.pilots, estimate.labels, estimate.colors))

    def _keep_final(self, estimate: Estimate, task: AdvanceTask, picture: Pixels) -> str:
        size = picture.shape[0], picture.shape[1]
        buffers = layers.composed(self.store, task.job, size, task.layers, task.recorded)
        for name, sheet in (buffers | estimate.layers(task.layers)).items():
            self.store.put_file(task.job, layers.file_name(name), image_files.encode_layer(sheet))
        data = image_files.encode_npy(picture)
        self.store.put_file(task.job, "image.npy", data)
        return hashlib.sha256(data).hexdigest()


def _advanced(estimate: Estimate) -> bool:
    """Decide about the next pass that has something to do; False where the picture is done."""
    goes_on = estimate.advance()
    while goes_on and not estimate.rays_wanted():
        goes_on = estimate.advance()
    return goes_on


def _samples_of(arrays: dict[str, Any]) -> Samples:
    """Make samples of what was kept of them."""
    return Samples(**arrays, counts={}, work={}, cpu_seconds=0.0)


def _members(samples: Samples) -> Iterator[tuple[str, object]]:
    return ((item.name, getattr(samples, item.name)) for item in fields(samples))
