"""Pictures of jobs of target quality while they run: the newest merged one, and the tiles finished since."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from schemas.jobs import TileEvent
from service.dispatch import adaptive_passes as targets
from service.jobs.context import Service
from service.storage.database.models import RenderRow
from service.storage.tiles import Pixels, StoredTile
from service.workers.pass_tiles import WHOLE


def so_far(service: Service, render: RenderRow, fresh: Sequence[StoredTile]) -> Pixels:
    """Put the picture together, (H, W, 3) float32.

    Parameters
    ----------
    fresh
        The finished tiles of the pass that is not merged yet.
    """
    image = np.zeros((render.height, render.width, 3), np.float32)
    if render.merges:
        image[:] = _merged(service, render)
    for part, found in zip(fresh, service.store.get_tiles(render.id, fresh), strict=True):
        tile = part.tile
        image[tile.y0 : tile.y1, tile.x0 : tile.x1] = found
    return image


def painted(events: Sequence[TileEvent]) -> list[TileEvent]:
    """Leave out the events of tiles over which a later one of the whole picture is painted."""
    whole = [place for place, event in enumerate(events) if event.tile == WHOLE]
    return list(events[whole[-1] :] if whole else events)


def pixels(
    service: Service, render: RenderRow, events: Sequence[TileEvent], fresh: Sequence[StoredTile]
) -> list[tuple[TileEvent, Pixels]]:
    """Give the events that show with their pixels as they are now.

    Parameters
    ----------
    fresh
        As in `so_far`.
    """
    shown = painted(events)
    wanted = {event.tile for event in shown if event.pass_index == len(render.merges)}
    parts = [part for part in fresh if part.tile.index in wanted]
    tiles = service.store.get_tiles(render.id, parts)
    newest = {part.tile.index: found for part, found in zip(parts, tiles, strict=True)}
    return [(event, _pixels(service, render, event, newest)) for event in shown]


def _pixels(service: Service, render: RenderRow, event: TileEvent, fresh: Mapping[int, Pixels]) -> Pixels:
    if event.pass_index == len(render.merges):
        return fresh[event.tile]
    return _merged(service, render)[event.y0 : event.y1, event.x0 : event.x1]


def _merged(service: Service, render: RenderRow) -> Pixels:
    return service.passes.get_picture(render.id, len(render.merges) - 1, targets.merged_by(render))
