"""What the workers of a job of target quality leave for each other, one set of files for each pass.

Every file is written under a temporary name and moved into place. Its name has the pass and the attempt, so
that an attempt that was given up cannot overwrite what a newer one has written.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from schemas.tiles import Tile
from service.errors import StoreDamagedError
from service.store.tiles import LAYERS_SUFFIX, Layers, Pixels, replacing

Demand = NDArray[np.uint8]
"""(2, H, W): the levels that the pixels have, and those that a pass wants."""

Labels = NDArray[np.int32]
"""(H, W): what the first looks met."""


class PassStore:
    """Files beside the tiles of a job, which go when those do.

    Parameters
    ----------
    folder : Path
        That of the tile store.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def put_samples(self, job: str, pass_index: int, tile: Tile, attempt: int, samples: Layers) -> None:
        """Keep what a pass has found in a tile."""
        self._put_arrays(self._samples(job, pass_index, tile, attempt), samples)

    def get_samples(self, job: str, pass_index: int, tile: Tile, attempt: int) -> Layers:
        """Return it; raise StoreDamagedError if it is not what was written."""
        return _arrays(self._samples(job, pass_index, tile, attempt))

    def put_state(self, job: str, pass_index: int, attempt: int, state: Layers) -> None:
        """Keep all that is known after a pass."""
        self._put_arrays(self._path(job, pass_index, f"state.{attempt}"), state)

    def get_state(self, job: str, pass_index: int, attempt: int) -> Layers:
        """Return it; raise StoreDamagedError if it is not what was written."""
        return _arrays(self._path(job, pass_index, f"state.{attempt}"))

    def put_demand(self, job: str, pass_index: int, attempt: int, demand: Demand) -> None:
        """Keep what the pass after this one shall do."""
        self._put_array(self._path(job, pass_index, f"demand.{attempt}"), demand)

    def get_demand(self, job: str, pass_index: int, attempt: int) -> Demand:
        """Return it, read from its file where it is looked at."""
        found: Demand = np.load(self._path(job, pass_index, f"demand.{attempt}"), mmap_mode="r")
        return found

    def put_labels(self, job: str, pass_index: int, attempt: int, labels: Labels) -> None:
        """Keep what the first looks met; the pass after this one needs it."""
        self._put_array(self._path(job, pass_index, f"labels.{attempt}"), labels)

    def get_labels(self, job: str, pass_index: int, attempt: int) -> Labels:
        """Return it, read from its file where it is looked at."""
        found: Labels = np.load(self._path(job, pass_index, f"labels.{attempt}"), mmap_mode="r")
        return found

    def put_picture(self, job: str, pass_index: int, attempt: int, picture: Pixels) -> None:
        """Keep the picture after a pass."""
        self._put_array(self._path(job, pass_index, f"picture.{attempt}"), picture)

    def get_picture(self, job: str, pass_index: int, attempt: int) -> Pixels:
        """Return it, read from its file where it is looked at."""
        found: Pixels = np.load(self._path(job, pass_index, f"picture.{attempt}"), mmap_mode="r")
        return found

    def drop_before(self, job: str, pass_index: int) -> None:
        """Forget all passes before this one with the pixels of their tiles, but not the layers of these."""
        for path in (self._folder / job / "tiles").glob("[0-9]*-*"):
            if int(path.name.partition("-")[0]) < pass_index and path.suffix != LAYERS_SUFFIX:
                path.unlink(missing_ok=True)

    def _samples(self, job: str, pass_index: int, tile: Tile, attempt: int) -> Path:
        return self._path(job, pass_index, f"{tile.index}.{attempt}.samples")

    def _path(self, job: str, pass_index: int, name: str) -> Path:
        return self._folder / job / "tiles" / f"{pass_index}-{name}"

    def _put_arrays(self, path: Path, arrays: Layers) -> None:
        with replacing(path) as file:
            members: dict[str, Any] = dict(arrays)
            np.savez(file, **members)

    def _put_array(self, path: Path, array: NDArray[Any]) -> None:
        with replacing(path) as file:
            np.save(file, array)


def _arrays(path: Path) -> Layers:
    try:
        # Every member of the archive has a CRC-32 of its own, which is checked.
        with path.open("rb") as file, np.load(file, allow_pickle=False) as found:
            return dict(found)
    except (ValueError, EOFError, zipfile.BadZipFile) as error:
        raise StoreDamagedError(f"{path.name} is damaged.") from error
