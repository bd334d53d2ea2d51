"""The layers of a job, assembled from its tiles."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

from renderer.layers import LAYERS, LayerBuffers
from schemas.tiles import Pass
from service.storage.tiles import Layers, StoredTile, TileStore


def recorded(parts: Iterable[StoredTile], names: Sequence[str]) -> list[StoredTile]:
    """Return the steps that have recorded some of these layers, among the finished ones of a job."""
    return [part for part in parts if records(part.pass_, names)]


def records(pass_: Pass, names: Sequence[str]) -> bool:
    """Whether a pass records some of these layers."""
    return any(LAYERS[name].recorded_in(pass_) for name in names)


def of_centres(name: str) -> bool:
    """Whether a layer is of the centres of pixels, and not of their samples."""
    return LAYERS[name].values is not None


def composed(
    store: TileStore, job: str, size: tuple[int, int], names: Sequence[str], parts: Iterable[StoredTile]
) -> Layers:
    """Put layers together; pixels that are not recorded yet have the values of those that show no shape.

    Parameters
    ----------
    size
        Height and width of the picture, pixels.
    names
        Which layers.
    parts
        Finished steps of the job, tile by tile, each in the order of its passes.
    """
    buffers = LayerBuffers([LAYERS[name] for name in names], *size)
    known = recorded(parts, names)
    found = zip(known, store.get_layers(job, known), strict=True)
    for _, passes in groupby(found, key=lambda one: one[0].tile.index):
        for part, arrays in passes:
            buffers.take(part.tile, arrays)
        buffers.settle()
    return buffers.finished()


def file_name(name: str) -> str:
    """The name of a finished layer in the store."""
    return f"layer-{name}.npy"
