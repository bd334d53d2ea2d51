"""Pictures of jobs of target quality while they run: the newest merged one, and the tiles finished since."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from schemas.jobs import TileEvent
from service import targets
from service.context import Service
from service.database.models import RenderRow
from service.store.tiles import Pixels, StoredTile
from service.target_tiles import WHOLE


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
    for part in fresh:
        tile = part.tile
        image[tile.y0 : tile.y1, tile.x0 : tile.x1] = service.store.get_tile(render.id, part)
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
    newest = {part.tile.index: part for part in fresh}
    return [(event, _pixels(service, render, event, newest)) for event in painted(events)]


def _pixels(service: Service, render: RenderRow, event: TileEvent, fresh: Mapping[int, StoredTile]) -> Pixels:
    if event.pass_index == len(render.merges):
        return service.store.get_tile(render.id, fresh[event.tile])
    return _merged(service, render)[event.y0 : event.y1, event.x0 : event.x1]


def _merged(service: Service, render: RenderRow) -> Pixels:
    return service.passes.get_picture(render.id, len(render.merges) - 1, targets.merged_by(render))
