"""What the workers of a job of target quality leave for each other, one set of files for each pass.

Every name has the pass and the attempt, so that an attempt that was given up cannot overwrite what a newer
one has written.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from schemas.tiles import Tile
from service.errors import StoreAwayError
from service.storage.objects import Objects
from service.storage.tiles import LAYERS_SUFFIX, TILES, Layers, Pixels, StoredTile, get_arrays, put_arrays

Levels = NDArray[np.uint8]
"""(4, H, W): the arrays of `renderer.adaptive.requests.LevelRequest`."""

Pilots = NDArray[np.float32]
"""(7, H, W): what pilot samples found, as `renderer.adaptive.guides.packed` writes it."""


class PassStore:
    """Files beside the tiles of a job, which go when those do.

    Parameters
    ----------
    objects : Objects
        That of the tile store.
    """

    def __init__(self, objects: Objects) -> None:
        self._objects = objects

    def put_samples(self, job: str, pass_index: int, tile: Tile, attempt: int, samples: Layers) -> None:
        """Keep what a pass has found in a tile."""
        put_arrays(self._objects, _samples(job, pass_index, tile, attempt), samples)

    def get_samples(self, job: str, pass_index: int, parts: Sequence[StoredTile]) -> Iterator[Layers]:
        """Give it for several tiles; raise StoreDamagedError if it is not what was written."""
        names = [_samples(job, pass_index, part.tile, part.attempt) for part in parts]
        return get_arrays(self._objects, names)

    def put_state(self, job: str, pass_index: int, attempt: int, state: Layers) -> None:
        """Keep all that is known after a pass."""
        put_arrays(self._objects, _name(job, pass_index, f"state.{attempt}"), state)

    def get_state(self, job: str, pass_index: int, attempt: int) -> Layers:
        """Return it; raise StoreDamagedError if it is not what was written."""
        return next(get_arrays(self._objects, [_name(job, pass_index, f"state.{attempt}")]))

    def put_levels(self, job: str, pass_index: int, attempt: int, levels: Levels) -> None:
        """Keep what the pass after this one shall do."""
        self._put_array(_name(job, pass_index, f"levels.{attempt}"), levels)

    def get_levels(self, job: str, pass_index: int, attempt: int) -> Levels:
        """Return it, for reading."""
        return self._objects.array(_name(job, pass_index, f"levels.{attempt}"))

    def put_pilots(self, job: str, pass_index: int, attempt: int, pilots: Pilots) -> None:
        """Keep what pilot samples found; the pass after this one needs it."""
        self._put_array(_name(job, pass_index, f"pilots.{attempt}"), pilots)

    def get_pilots(self, job: str, pass_index: int, attempt: int) -> Pilots:
        """Return it, for reading."""
        return self._objects.array(_name(job, pass_index, f"pilots.{attempt}"))

    def put_picture(self, job: str, pass_index: int, attempt: int, picture: Pixels) -> None:
        """Keep the picture after a pass."""
        self._put_array(_name(job, pass_index, f"picture.{attempt}"), picture)

    def get_picture(self, job: str, pass_index: int, attempt: int) -> Pixels:
        """Return it, for reading."""
        return self._objects.array(_name(job, pass_index, f"picture.{attempt}"))

    def drop_before(self, job: str, pass_index: int) -> None:
        """Forget all passes before this one with the pixels of their tiles, but not the layers of these."""
        # What stays where the place is away goes with the tiles.
        with suppress(StoreAwayError):
            names = [found.name for found in self._objects.found(f"{job}/{TILES}")]
            self._objects.delete(name for name in names if _is_before(name.rpartition("/")[2], pass_index))

    def _put_array(self, name: str, array: NDArray[Any]) -> None:
        with self._objects.draft(name) as draft:
            np.save(draft, array)
            self._objects.keep(draft, name)


def _samples(job: str, pass_index: int, tile: Tile, attempt: int) -> str:
    return _name(job, pass_index, f"{tile.index}.{attempt}.samples")


def _name(job: str, pass_index: int, name: str) -> str:
    return f"{job}/{TILES}/{pass_index}-{name}"


def _is_before(name: str, pass_index: int) -> bool:
    number, _, rest = name.partition("-")
    return number.isdecimal() and int(number) < pass_index and not rest.endswith(LAYERS_SUFFIX)
