"""The layers of a job, put together from the tiles that have recorded them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from renderer.layers import LAYERS
from service.store.tiles import Layers, StoredTile, TileStore


def recorded(parts: Iterable[StoredTile]) -> list[StoredTile]:
    """Give the steps that have layers, among the finished ones of a job: those where the samples begin."""
    return [part for part in parts if part.pass_.begins]


def composed(
    store: TileStore, job: str, size: tuple[int, int], names: Sequence[str], parts: Iterable[StoredTile]
) -> Layers:
    """Put layers together; pixels that are not recorded yet look like those that show no shape.

    Parameters
    ----------
    size
        Height and width of the picture, pixels.
    names
        Which layers.
    parts
        Finished steps of the job.
    """
    sheets = {name: LAYERS[name].blank(*size) for name in names}
    for part in recorded(parts) if names else ():
        tile, found = part.tile, store.get_layers(job, part)
        for name, sheet in sheets.items():
            sheet[tile.y0 : tile.y1, tile.x0 : tile.x1] = found[name]
    return sheets


def file_name(name: str) -> str:
    """Say under which name a finished layer lies in the store."""
    return f"layer-{name}.npy"
