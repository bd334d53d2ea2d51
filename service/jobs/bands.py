"""Pictures and layers, final or partial, in bands of rows to save memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from renderer import film
from schemas.tiles import Tile
from service.dispatch import adaptive_passes as adaptive
from service.lifecycle import rows
from service.storage.database.models import RenderRow
from service.storage.tiles import Layers, Pixels, StoredRows, StoredTile, TileStore
from service.workers import layers

BAND_PIXELS = 1 << 18
"""Pixels of a band, unless a tile is higher."""

Band = tuple[Pixels, Layers]


@dataclass(frozen=True)
class Finished:
    """Snapshot of the finished tiles of a render; empty once its picture is final.

    Attributes
    ----------
    job : str
        The requested job; a render may have several.
    coarse : StoredTile or None
        The preview.
    parts : tuple of StoredTile
        The finished steps that have samples, tile by tile.
    recorded : tuple of StoredTile
        Those that may have recorded layers.
    """

    job: str
    render: RenderRow
    coarse: StoredTile | None = None
    parts: tuple[StoredTile, ...] = ()
    recorded: tuple[StoredTile, ...] = ()

    def bands(self, store: TileStore, names: Sequence[str]) -> Iterator[Band]:
        """Yield the picture and some of its layers from top to bottom."""
        if self.render.image_sha256 is not None:
            return _final(store, self.render, names)
        return _so_far(store, self, names)

    def layer(self, store: TileStore, name: str) -> Iterator[Layers]:
        """Yield a layer of an unfinished picture from top to bottom."""
        parts = layers.recorded(self.recorded, (name,))
        for top, bottom in _divided(self.render, (part.tile for part in parts)):
            yield _layers(store, self, (name,), top, bottom)


def _final(store: TileStore, render: RenderRow, names: Sequence[str]) -> Iterator[Band]:
    prefix = render.final_prefix

    def opened(file: str) -> StoredRows:
        return store.get_rows(render.id, prefix + file, rows.expected(render, prefix + file))

    picture, sheets = opened("image.npy"), {name: opened(layers.file_name(name)) for name in names}
    for top, bottom in _divided(render, ()):
        yield picture.read(top, bottom), {name: sheet.read(top, bottom) for name, sheet in sheets.items()}


def _so_far(store: TileStore, finished: Finished, names: Sequence[str]) -> Iterator[Band]:
    render, ground = finished.render, _ground(store, finished)
    recorded = layers.recorded(finished.recorded, names)
    for top, bottom in _divided(render, (part.tile for part in (*finished.parts, *recorded))):
        pixels = ground(top, bottom)
        for tile, found in _tiles(store, render, _within(finished.parts, top, bottom)):
            pixels[tile.y0 - top : tile.y1 - top, tile.x0 : tile.x1] = found
        yield pixels, _layers(store, finished, names, top, bottom)


def _ground(store: TileStore, finished: Finished) -> Callable[[int, int], Pixels]:
    """Return the picture behind unfinished tiles: the newest merged one, the preview, or black."""
    render, coarse = finished.render, finished.coarse
    if render.merges:
        newest = len(render.merges) - 1, adaptive.merged_by(render)
        merged = store.get_map_rows(render.id, *newest, "picture", rows.checksums_of(render))
        return lambda top, bottom: merged.read(top, bottom).copy()
    if coarse is not None:
        preview, stride = store.get_tile(render.id, coarse), coarse.pass_.stride
        columns = np.arange(render.width) // stride
        return lambda top, bottom: preview[np.arange(top, bottom)[:, None] // stride, columns]
    return lambda top, bottom: np.zeros((bottom - top, render.width, 3), np.float32)


def _tiles(store: TileStore, render: RenderRow, parts: Sequence[StoredTile]) -> Iterator[tuple[Tile, Pixels]]:
    if render.target_error is None:
        return means(store, render.id, parts)
    found = store.get_tiles(render.id, parts)
    return ((part.tile, pixels) for part, pixels in zip(parts, found, strict=True))


def means(store: TileStore, job_id: str, parts: Sequence[StoredTile]) -> Iterator[tuple[Tile, Pixels]]:
    """Yield the mean of all samples of each tile; its finished passes are given in order."""
    found = zip(parts, store.get_tiles(job_id, parts), strict=True)
    for _, group in groupby(found, key=lambda one: one[0].tile.index):
        steps = list(group)
        yield steps[0][0].tile, film.compose([(part.pass_, pixels) for part, pixels in steps])


def _layers(store: TileStore, finished: Finished, names: Sequence[str], top: int, bottom: int) -> Layers:
    """Assemble layers of a band, in coordinates that begin at its first row."""
    parts = [
        replace(part, tile=replace(part.tile, y0=part.tile.y0 - top, y1=part.tile.y1 - top))
        for part in _within(finished.recorded, top, bottom)
    ]
    render = finished.render
    return layers.composed(store, render.id, (bottom - top, render.width), names, parts)


def _within(parts: Iterable[StoredTile], top: int, bottom: int) -> list[StoredTile]:
    return [part for part in parts if top <= part.tile.y0 < bottom]


def _divided(render: RenderRow, tiles: Iterable[Tile]) -> Iterator[tuple[int, int]]:
    """Yield the first row of each band, and the one after its last; no tile lies in two bands."""
    top = bottom = 0
    for tile in sorted(tiles, key=lambda tile: tile.y0):
        if tile.y0 >= bottom:
            if bottom > top:
                yield top, bottom
            yield from _empty(render, bottom, tile.y0)
            top = tile.y0
        bottom = max(bottom, tile.y1)
    if bottom > top:
        yield top, bottom
    yield from _empty(render, bottom, render.height)


def _empty(render: RenderRow, begin: int, end: int) -> Iterator[tuple[int, int]]:
    """Divide rows that no finished tile crosses."""
    rows = max(1, BAND_PIXELS // render.width)
    for top in range(begin, end, rows):
        yield top, min(top + rows, end)
