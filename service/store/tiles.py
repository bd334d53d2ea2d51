"""The store of pixels: what it must do, and how files do it."""

from __future__ import annotations

import errno
import shutil
import tempfile
import time
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from schemas.tiles import Pass, Tile
from service.errors import StoreDamagedError, StoreFullError, StoreReadOnlyError

Pixels = NDArray[np.float32]
Layers = dict[str, NDArray[Any]]
LAYERS_SUFFIX = ".npz"
UNFINISHED_SECONDS = 3600.0
"""What is younger may be what another server writes at the moment."""

NO_ROOM = "The disk is full. Try again when there is room."
NOT_WRITABLE = "The data folder cannot be written now. Try again when its operator has seen to it."

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
READ_ONLY = (errno.EROFS, errno.EACCES, errno.EPERM)


@dataclass(frozen=True)
class StoredTile:
    """A finished step: which pixels, which attempt wrote them, and the checksum of its bytes."""

    tile: Tile
    pass_: Pass
    attempt: int
    crc32: int

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of its pixels: rows, columns, channels."""
        return _shape(self.tile, self.pass_)


class TileStore(Protocol):
    """Keeps the pixels of jobs. Every write is atomic: a reader sees all of it or nothing."""

    def check(self) -> None:
        """Raise a StoreError or an OSError where nothing can be kept now."""

    def put_spec(self, job: str, spec: bytes) -> None:
        """Keep what a job was asked to render."""

    def get_spec(self, job: str) -> bytes:
        """Return what ``put_spec`` was given."""

    def put_tile(self, job: str, tile: Tile, pass_: Pass, attempt: int, pixels: Pixels) -> int:
        """Keep the pixels of one step and return their CRC-32."""

    def get_tile(self, job: str, stored: StoredTile) -> Pixels:
        """Return the pixels of one step; raise StoreDamagedError if they are not what was written."""

    def put_layers(self, job: str, tile: Tile, pass_: Pass, attempt: int, layers: Layers) -> None:
        """Keep the layers that one step recorded, before its pixels."""

    def get_layers(self, job: str, stored: StoredTile) -> Layers:
        """Return the layers of one step; raise StoreDamagedError if they are not what was written."""

    def put_file(self, job: str, name: str, data: bytes) -> Path:
        """Keep a result of a job under a name and return where it lies."""

    def file(self, job: str, name: str) -> Path:
        """Return where a result of a job lies, or would lie."""

    def drop_tiles(self, job: str) -> None:
        """Forget the tiles of a job; nothing happens if there are none."""

    def drop_job(self, job: str) -> None:
        """Forget everything about a job; nothing happens if there is nothing."""

    def sizes(self) -> dict[str, int]:
        """Return the bytes that each job takes."""

    def sweep(self, jobs: set[str], age_seconds: float) -> None:
        """Remove what of this age a killed process left behind, or belongs to no job in ``jobs``."""


class FileTileStore:
    """One folder a job; in it one file for each tile and pass.

    Parameters
    ----------
    folder : Path
        Made when the first job arrives.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def check(self) -> None:
        """Raise a StoreError or an OSError where nothing can be kept now."""
        with _told():
            self.folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=self.folder) as file:
                file.write(b"whether there is room for this")

    def put_spec(self, job: str, spec: bytes) -> None:
        """Keep what a job was asked to render."""
        with _told():
            (self.folder / job / "tiles").mkdir(parents=True, exist_ok=True)
        self.put_file(job, "spec.json", spec)

    def get_spec(self, job: str) -> bytes:
        """Return what ``put_spec`` was given."""
        return self.file(job, "spec.json").read_bytes()

    def put_tile(self, job: str, tile: Tile, pass_: Pass, attempt: int, pixels: Pixels) -> int:
        """Keep the pixels of one step and return their CRC-32."""
        data = pixels.astype("<f4", copy=False).tobytes()
        with replacing(self._tile(job, tile, pass_, attempt)) as file:
            file.write(data)
        return zlib.crc32(data)

    def get_tile(self, job: str, stored: StoredTile) -> Pixels:
        """Return the pixels of one step; raise StoreDamagedError if they are not what was written."""
        data = self._tile(job, stored.tile, stored.pass_, stored.attempt).read_bytes()
        if zlib.crc32(data) != stored.crc32:
            raise StoreDamagedError(f"Tile {stored.tile.index} of pass {stored.pass_.index} is damaged.")
        return np.frombuffer(data, dtype="<f4").reshape(stored.shape)

    def put_layers(self, job: str, tile: Tile, pass_: Pass, attempt: int, layers: Layers) -> None:
        """Keep the layers that one step recorded, before its pixels."""
        with replacing(self._layers(job, tile, pass_, attempt)) as file:
            members: dict[str, Any] = dict(layers)
            np.savez(file, **members)

    def get_layers(self, job: str, stored: StoredTile) -> Layers:
        """Return the layers of one step; raise StoreDamagedError if they are not what was written."""
        path = self._layers(job, stored.tile, stored.pass_, stored.attempt)
        try:
            # Every member of the archive has a CRC-32 of its own, which is checked.
            with path.open("rb") as file, np.load(file, allow_pickle=False) as found:
                return dict(found)
        except (ValueError, EOFError, zipfile.BadZipFile) as error:
            raise StoreDamagedError(f"Layers of tile {stored.tile.index} are damaged.") from error

    def put_file(self, job: str, name: str, data: bytes) -> Path:
        """Keep a result of a job under a name and return where it lies."""
        path = self.file(job, name)
        with replacing(path) as file:
            file.write(data)
        return path

    def file(self, job: str, name: str) -> Path:
        """Return where a result of a job lies, or would lie."""
        return self.folder / job / name

    def drop_tiles(self, job: str) -> None:
        """Forget the tiles of a job; nothing happens if there are none."""
        shutil.rmtree(self.folder / job / "tiles", ignore_errors=True)

    def drop_job(self, job: str) -> None:
        """Forget everything about a job; nothing happens if there is nothing."""
        shutil.rmtree(self.folder / job, ignore_errors=True)

    def sizes(self) -> dict[str, int]:
        """Return the bytes that each job takes."""
        return {folder.name: _bytes_in(folder) for folder in self.folder.glob("*")}

    def sweep(self, jobs: set[str], age_seconds: float) -> None:
        """Remove what of this age a killed process left behind, or belongs to no job in ``jobs``."""
        for folder in self.folder.glob("*"):
            if folder.name not in jobs and is_older(folder, age_seconds):
                self.drop_job(folder.name)
        sweep_temporary(self.folder, age_seconds)

    def _tile(self, job: str, tile: Tile, pass_: Pass, attempt: int) -> Path:
        return self.folder / job / "tiles" / f"{pass_.index}-{tile.index}.{attempt}"

    def _layers(self, job: str, tile: Tile, pass_: Pass, attempt: int) -> Path:
        path = self._tile(job, tile, pass_, attempt)
        return path.with_name(f"{path.name}{LAYERS_SUFFIX}")


def _bytes_in(folder: Path) -> int:
    # Files come and go while others render, and read, and delete.
    return sum(size for path in folder.rglob("*") if (size := _size(path)))


def _size(path: Path) -> int:
    try:
        return path.stat().st_size if path.is_file() else 0
    except OSError:
        return 0


def _shape(tile: Tile, pass_: Pass) -> tuple[int, int, int]:
    height, width = tile.y1 - tile.y0, tile.x1 - tile.x0
    return -(-height // pass_.stride), -(-width // pass_.stride), 3


@contextmanager
def replacing(path: Path) -> Iterator[IO[bytes]]:
    """Open a temporary file that takes the place of ``path`` when the block ends well.

    Raises
    ------
    StoreFullError
        If the disk is full.
    StoreReadOnlyError
        If the folder may not be written.
    """
    with (
        _told(),
        tempfile.NamedTemporaryFile(dir=path.parent, prefix=".", suffix=".tmp", delete=False) as file,
    ):
        try:
            yield file
            file.flush()
            Path(file.name).replace(path)
        except BaseException:
            Path(file.name).unlink(missing_ok=True)
            raise


@contextmanager
def _told() -> Iterator[None]:
    """Tell a disk that cannot be written now, which passes, from all other errors."""
    try:
        yield
    except OSError as error:
        if error.errno in FULL:
            raise StoreFullError(NO_ROOM) from error
        if error.errno in READ_ONLY:
            raise StoreReadOnlyError(NOT_WRITABLE) from error
        raise


def sweep_temporary(folder: Path, age_seconds: float) -> None:
    """Remove the temporary files of this age that a killed process left in a folder."""
    for path in folder.rglob(".*.tmp"):
        if is_older(path, age_seconds):
            path.unlink(missing_ok=True)


def is_older(path: Path, age_seconds: float) -> bool:
    """Whether nothing was written here for so long; of age 0 is everything."""
    try:
        return not age_seconds or path.stat().st_mtime < time.time() - age_seconds
    except FileNotFoundError:
        return False
