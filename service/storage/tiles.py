"""The store of pixels: tiles, layers, results of jobs, and the state between passes of target quality."""

from __future__ import annotations

import io
import math
import re
import time
import zipfile
import zlib
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import IO, Any, Literal

import numpy as np
from numpy.typing import NDArray

from schemas.tiles import Pass, Tile
from service.errors import StoreAwayError, StoreDamagedError
from service.storage.objects import Objects, Stored

Pixels = NDArray[np.float32]
Layers = dict[str, NDArray[Any]]
PassMap = Literal["levels", "pilots", "picture"]
"""What a pass of target quality leaves for the next one: the samples that it requests, uint8 (4, H, W), pilot
samples, float32 (7, H, W), and the picture after it."""
LAYERS_SUFFIX = ".npz"
TILES = "tiles"
NPY_HEAD_BYTES = 4096
"""More than the head of an .npy file has that was written here."""
UNFINISHED_SECONDS = 3600.0
"""What is younger may be a file that another server is writing."""
_FINAL = re.compile(r"((?:\d+-)?)(?:image[.-]|layer-)")
"""The names of pictures, thumbnails and layers, and the prefix of each; those of version 0.1 have none."""


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


class StoredRows:
    """An .npy file in the store, of which rows are read and no others.

    Attributes
    ----------
    shape, dtype
        Of the whole array.
    """

    def __init__(self, stored: Stored) -> None:
        head = io.BytesIO(stored.read(0, min(stored.size, NPY_HEAD_BYTES)))
        np.lib.format.read_magic(head)
        self.shape, _, self.dtype = np.lib.format.read_array_header_1_0(head)
        self._row_bytes = self.dtype.itemsize * math.prod(self.shape[1:])
        self._stored, self._begin = stored, stored.size - self.shape[0] * self._row_bytes

    def read(self, top: int, bottom: int) -> NDArray[Any]:
        """Return the rows from the first number up to the second."""
        places = (self._begin + row * self._row_bytes for row in (top, bottom))
        return np.frombuffer(self._stored.read(*places), self.dtype).reshape(-1, *self.shape[1:])


class TileStore:
    """Keeps the pixels of jobs. Every write is atomic: a reader sees all of it or nothing.

    What an attempt writes has its number in the name, so that one that was given up overwrites nothing.

    Parameters
    ----------
    objects : Objects
        Where all of it lies: under the name of each job its results, and under ``tiles`` there one entry for
        each tile and pass.
    """

    def __init__(self, objects: Objects) -> None:
        self.objects = objects

    def check(self) -> None:
        """Raise a StoreError or an OSError where nothing can be kept now."""
        self.objects.begin("")
        self.objects.check()
        with self.objects.draft("room") as draft:
            draft.write(b"whether there is room for this")

    def put_spec(self, job: str, spec: bytes) -> None:
        """Keep what a job was asked to render."""
        self.objects.begin(f"{job}/{TILES}")
        self.put_file(job, "spec.json", spec)

    def get_spec(self, job: str) -> bytes:
        """Return what ``put_spec`` was given."""
        return self.get_file(job, "spec.json")

    def put_tile(self, job: str, tile: Tile, pass_: Pass, attempt: int, pixels: Pixels) -> int:
        """Keep the pixels of one step and return their CRC-32."""
        data = pixels.astype("<f4", copy=False).tobytes()
        self.objects.put(_name(job, tile, pass_, attempt), data)
        return zlib.crc32(data)

    def get_tile(self, job: str, stored: StoredTile) -> Pixels:
        """Return the pixels of one step; raise StoreDamagedError if they are not what was written."""
        return next(self.get_tiles(job, [stored]))

    def get_tiles(self, job: str, parts: Sequence[StoredTile]) -> Iterator[Pixels]:
        """Return the pixels of several steps in their order, as ``get_tile`` does."""
        found = self.objects.many([_name_of(job, part) for part in parts])
        return (_pixels(part, data) for part, data in zip(parts, found, strict=True))

    def put_layers(self, job: str, tile: Tile, pass_: Pass, attempt: int, layers: Layers) -> None:
        """Keep the layers that one step recorded, before its pixels."""
        put_arrays(self.objects, f"{_name(job, tile, pass_, attempt)}{LAYERS_SUFFIX}", layers)

    def get_layers(self, job: str, parts: Sequence[StoredTile]) -> Iterator[Layers]:
        """Return the layers of several steps; raise StoreDamagedError if they are not what was written."""
        return get_arrays(self.objects, [f"{_name_of(job, part)}{LAYERS_SUFFIX}" for part in parts])

    def put_file(self, job: str, name: str, data: bytes) -> None:
        """Keep a result of a job under a name."""
        self.objects.put(f"{job}/{name}", data)

    def put_final(self, job: str, attempt: int, name: str, data: bytes) -> int:
        """Keep a file of the final picture that an attempt has composed, beside those of other attempts.

        Returns
        -------
        int
            Its bytes.
        """
        self.put_file(job, f"{final_prefix(attempt)}{name}", data)
        return len(data)

    def get_file(self, job: str, name: str) -> bytes:
        """Return a result of a job."""
        return self.objects.get(f"{job}/{name}")

    def get_array(self, job: str, name: str) -> NDArray[Any]:
        """Return a result of a job that is an .npy file, for reading."""
        return self.objects.array(f"{job}/{name}")

    def get_rows(self, job: str, name: str) -> StoredRows:
        """Open a result of a job that is an .npy file, to read some of its rows."""
        return self._rows(f"{job}/{name}")

    def find(self, job: str, name: str) -> Stored | None:
        """Describe a result of a job; None if there is none."""
        return self.objects.find(f"{job}/{name}")

    def put_samples(self, job: str, pass_index: int, tile: Tile, attempt: int, samples: Layers) -> None:
        """Keep the samples that a pass of target quality has taken in a tile."""
        put_arrays(self.objects, _samples_name(job, pass_index, tile, attempt), samples)

    def get_samples(self, job: str, pass_index: int, parts: Sequence[StoredTile]) -> Iterator[Layers]:
        """Return the samples of several tiles; raise StoreDamagedError if they are not what was written."""
        names = [_samples_name(job, pass_index, part.tile, part.attempt) for part in parts]
        return get_arrays(self.objects, names)

    def put_state(self, job: str, pass_index: int, attempt: int, state: Layers) -> None:
        """Keep the estimate after a pass."""
        put_arrays(self.objects, _pass_name(job, pass_index, "state", attempt), state)

    def get_state(self, job: str, pass_index: int, attempt: int) -> Layers:
        """Return the estimate after a pass; raise StoreDamagedError if it is not what was written."""
        return next(get_arrays(self.objects, [_pass_name(job, pass_index, "state", attempt)]))

    def put_map(self, job: str, pass_index: int, attempt: int, kind: PassMap, array: NDArray[Any]) -> None:
        """Keep an array over the pixels that the next pass, or a reader of the picture, needs."""
        name = _pass_name(job, pass_index, kind, attempt)
        with self.objects.draft(name) as draft:
            np.save(draft, array)
            self.objects.keep(draft, name)

    def get_map(self, job: str, pass_index: int, attempt: int, kind: PassMap) -> NDArray[Any]:
        """Return what ``put_map`` was given, read-only."""
        return self.objects.array(_pass_name(job, pass_index, kind, attempt))

    def get_map_rows(self, job: str, pass_index: int, attempt: int, kind: PassMap) -> StoredRows:
        """Open what ``put_map`` was given, to read some of its rows."""
        return self._rows(_pass_name(job, pass_index, kind, attempt))

    def _rows(self, name: str) -> StoredRows:
        stored = self.objects.find(name)
        if stored is None:
            raise FileNotFoundError(name)
        return StoredRows(stored)

    def drop_passes_before(self, job: str, pass_index: int) -> None:
        """Delete the files of all earlier passes with the pixels of their tiles, but not their layers."""
        # What stays where the place cannot be reached goes with the tiles.
        with suppress(StoreAwayError):
            names = [found.name for found in self.objects.found(f"{job}/{TILES}")]
            self.objects.delete(name for name in names if _is_before(name.rpartition("/")[2], pass_index))

    def drop_tiles(self, job: str) -> None:
        """Forget the tiles of a job; nothing happens if there are none."""
        self.objects.drop(f"{job}/{TILES}")

    def drop_job(self, job: str) -> None:
        """Forget everything about a job; nothing happens if there is nothing."""
        self.objects.drop(job)

    def sizes(self) -> dict[str, int]:
        """Return the bytes that each job takes."""
        sizes: defaultdict[str, int] = defaultdict(int)
        for found in self.objects.found():
            sizes[found.name.partition("/")[0]] += found.size
        return dict(sizes)

    def sweep(self, jobs: Collection[str], ended: Mapping[str, str | None], age_seconds: float) -> None:
        """Remove what a killed process left behind.

        Parameters
        ----------
        jobs
            All that there are; what belongs to no other is removed once it has this age.
        ended
            Those of them that need no tiles any more, with the prefix of their final files, or None where
            there is no picture: final files of other attempts are removed.
        """
        newest: defaultdict[str, float] = defaultdict(float)
        tiled, unrecorded = set(), []
        for found in self.objects.found():
            job, _, rest = found.name.partition("/")
            newest[job] = max(newest[job], found.modified)
            if job not in ended:
                continue
            final = _FINAL.match(rest)
            if final and final[1] != ended[job]:
                unrecorded.append(found.name)
            elif rest.startswith(f"{TILES}/"):
                tiled.add(job)
        self.objects.delete(unrecorded)
        for job in tiled:
            self.drop_tiles(job)
        since = time.time() - age_seconds
        for job in newest.keys() - set(jobs):
            if not age_seconds or newest[job] < since:
                self.drop_job(job)
        self.objects.tidy(age_seconds)


def final_prefix(attempt: int) -> str:
    """Return what the names of the final files begin with that an attempt writes."""
    return f"{attempt}-"


def put_arrays(objects: Objects, name: str, arrays: Layers) -> None:
    """Keep arrays as one .npz file."""
    members: dict[str, Any] = dict(arrays)
    with objects.draft(name) as draft:
        np.savez(draft, **members)
        objects.keep(draft, name)


def get_arrays(objects: Objects, names: Sequence[str]) -> Iterator[Layers]:
    """Return the arrays of several .npz files; raise StoreDamagedError if one is not what was written."""
    return (_arrays(name, io.BytesIO(data)) for name, data in zip(names, objects.many(names), strict=True))


def _arrays(name: str, file: IO[bytes]) -> Layers:
    try:
        # Every member of the archive has a CRC-32 of its own, which is checked.
        with np.load(file, allow_pickle=False) as found:
            return dict(found)
    except (ValueError, EOFError, zipfile.BadZipFile) as error:
        raise StoreDamagedError(f"{name.rpartition('/')[2]} is damaged.") from error


def _name(job: str, tile: Tile, pass_: Pass, attempt: int) -> str:
    return f"{job}/{TILES}/{pass_.index}-{tile.index}.{attempt}"


def _name_of(job: str, part: StoredTile) -> str:
    return _name(job, part.tile, part.pass_, part.attempt)


def _pixels(part: StoredTile, data: bytes) -> Pixels:
    if zlib.crc32(data) != part.crc32:
        raise StoreDamagedError(f"Tile {part.tile.index} of pass {part.pass_.index} is damaged.")
    return np.frombuffer(data, dtype="<f4").reshape(part.shape)


def _shape(tile: Tile, pass_: Pass) -> tuple[int, int, int]:
    height, width = tile.y1 - tile.y0, tile.x1 - tile.x0
    return -(-height // pass_.stride), -(-width // pass_.stride), 3


def _samples_name(job: str, pass_index: int, tile: Tile, attempt: int) -> str:
    return f"{job}/{TILES}/{pass_index}-{tile.index}.{attempt}.samples"


def _pass_name(job: str, pass_index: int, kind: str, attempt: int) -> str:
    return f"{job}/{TILES}/{pass_index}-{kind}.{attempt}"


def _is_before(name: str, pass_index: int) -> bool:
    number, _, rest = name.partition("-")
    return number.isdecimal() and int(number) < pass_index and not rest.endswith(LAYERS_SUFFIX)
