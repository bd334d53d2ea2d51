"""The layers of a job, assembled from its tiles, and the files of its final picture."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from itertools import groupby

from renderer.images import files as image_files
from renderer.layers import LAYERS, LayerBuffers
from schemas.tiles import Pass
from service.storage.checksums import Checksum
from service.storage.tiles import Layers, Pixels, Step, StoredTile, TileStore, damaged_steps


def recorded(parts: Iterable[StoredTile], names: Sequence[str]) -> list[StoredTile]:
    """Return the steps that have recorded some of these layers, among the finished ones of a job."""
    return [part for part in parts if records(part.pass_, names)]


def records(pass_: Pass, names: Sequence[str]) -> bool:
    """Whether a pass records some of these layers."""
    return any(LAYERS[name].recorded_in(pass_) for name in names)


def of_centres(name: str) -> bool:
    """Whether a layer describes the centres of pixels, not their samples."""
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
        The layers.
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


def damaged(store: TileStore, job: str, names: Sequence[str], parts: Iterable[StoredTile]) -> list[Step]:
    """Return the steps whose layers are damaged or missing, where `composed` could not put them together."""
    return damaged_steps(recorded(parts, names), lambda part: next(store.get_layers(job, [part])))


def put_final(
    store: TileStore, job: str, attempt: int, picture: Pixels, sheets: Layers
) -> tuple[str, dict[str, Checksum]]:
    """Keep a final picture and its layers; return the picture's SHA-256, and the checksums of all files."""
    checksums = dict[str, Checksum]()
    for name, sheet in sheets.items():
        checksums |= store.put_final(job, attempt, file_name(name), image_files.encode_layer(sheet))
    data = image_files.encode_npy(picture)
    checksums |= store.put_final(job, attempt, "image.npy", data)
    return hashlib.sha256(data).hexdigest(), checksums


def file_name(name: str) -> str:
    """The name of a finished layer in the store."""
    return f"layer-{name}.npy"
