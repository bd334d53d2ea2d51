"""The store of pixels: tiles, layers, results of jobs, and the state between passes of target quality."""

from __future__ import annotations

import errno
import io
import math
import re
import time
import zlib
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import IO, Any, Literal

import numpy as np
from numpy.typing import NDArray

from schemas.tiles import Pass, Tile
from service.errors import RequestDamagedError, StoreAwayError, StoreDamagedError
from service.storage.checking import checked
from service.storage.checksums import (
    LOSS_ERRORS,
    Checksum,
    Expected,
    checksum_of,
    checksum_of_file,
    damage_reported,
    is_lost,
    is_whole,
    read_checked,
)
from service.storage.objects import Objects, Stored

Pixels = NDArray[np.float32]
Layers = dict[str, NDArray[Any]]
PassMap = Literal["levels", "pilots", "picture"]
"""Results of a pass of target quality for the next one: the samples that it requests, uint8 (4, H, W), pilot
samples, float32 (7, H, W), and the picture after it."""
Step = tuple[int, int]
"""The index of a pass, and the number of a tile."""
Checksums = Mapping[str, Checksum]
"""Checksums of the files of a job, by their names below its own."""
NO_CHECKSUMS: Checksums = {}
LAYERS_SUFFIX, SAMPLES_SUFFIX, UNFINISHED_SUFFIX = ".npz", ".samples", ".unfinished"
"""Suffixes of the files that accompany the pixels of a step."""
TILES, SPEC = "tiles", "spec.json"
NPY_HEAD_BYTES = 4096
"""Bytes read for the header of an .npy file; those of this service are shorter."""
MEMBER_COUNT = slice(-12, -10)
"""Offset of the number of members from the end of an .npz file."""
UNFINISHED_SECONDS = 3600.0
"""Age from which on a temporary file is deleted: another server may be writing a younger one."""
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

    def __init__(self, name: str, stored: Stored) -> None:
        head = io.BytesIO(stored.read(0, min(stored.size, NPY_HEAD_BYTES)))
        with damage_reported(name):
            np.lib.format.read_magic(head)
            self.shape, _, self.dtype = np.lib.format.read_array_header_1_0(head)
        self._row_bytes = self.dtype.itemsize * math.prod(self.shape[1:])
        self._name, self._stored = name, stored
        self._begin = stored.size - self.shape[0] * self._row_bytes

    def read(self, top: int, bottom: int) -> NDArray[Any]:
        """Return the rows from the first number up to the second."""
        offsets = (self._begin + row * self._row_bytes for row in (top, bottom))
        content = self._stored.read(*offsets)
        with damage_reported(self._name):
            return np.frombuffer(content, self.dtype).reshape(bottom - top, *self.shape[1:])


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
        """Raise a StoreError or an OSError if nothing can be kept now."""
        self.objects.begin("")
        self.objects.check()
        with self.objects.draft("room") as draft:
            draft.write(b"whether there is room for this")

    def put_spec(self, job: str, spec: bytes) -> None:
        """Keep what a job was asked to render."""
        self.objects.begin(f"{job}/{TILES}")
        self.objects.put(f"{job}/{SPEC}", spec, durable=True)

    def get_spec(self, job: str, sha256: str) -> bytes:
        """Return what ``put_spec`` was given; RequestDamagedError if that is not there."""
        try:
            return self.get_file(job, SPEC, sha256)
        except (FileNotFoundError, StoreDamagedError) as error:
            raise RequestDamagedError from error

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
        found = self.objects.many([tile_name(job, part) for part in parts])
        return (_pixels(job, part, data) for part, data in zip(parts, found, strict=True))

    def put_layers(self, job: str, tile: Tile, pass_: Pass, attempt: int, layers: Layers) -> None:
        """Keep the layers that one step recorded, before its pixels."""
        _put_arrays(self.objects, f"{_name(job, tile, pass_, attempt)}{LAYERS_SUFFIX}", layers)

    def get_layers(self, job: str, parts: Sequence[StoredTile]) -> Iterator[Layers]:
        """Return the layers of several steps; raise StoreDamagedError if they are not what was written."""
        return _get_arrays(self.objects, [f"{tile_name(job, part)}{LAYERS_SUFFIX}" for part in parts])

    def put_unfinished(self, job: str, tile: Tile, pass_: Pass, arrays: Layers) -> None:
        """Keep a tile that was preempted.

        Attempts share the file: what any of them has left is right, some of it only less far.
        """
        _put_arrays(self.objects, _unfinished_name(job, tile, pass_), arrays)

    def get_unfinished(self, job: str, tile: Tile, pass_: Pass) -> Layers | None:
        """Return what ``put_unfinished`` was given; None if it is lost, so that the tile begins anew."""
        with suppress(*LOSS_ERRORS):
            return next(_get_arrays(self.objects, [_unfinished_name(job, tile, pass_)]))
        return None

    def put_file(self, job: str, name: str, data: bytes) -> None:
        """Keep a result of a job under a name."""
        self.objects.put(f"{job}/{name}", data)

    def put_final(self, job: str, attempt: int, name: str, data: bytes) -> Checksums:
        """Keep a file of the final picture that an attempt has composed, beside those of other attempts."""
        kept = f"{final_prefix(attempt)}{name}"
        self.objects.put(f"{job}/{kept}", data, durable=True)
        return {kept: checksum_of(data)}

    def get_file(self, job: str, name: str, expected: Expected = None) -> bytes:
        """Return a result of a job."""
        path = f"{job}/{name}"
        return read_checked(path, lambda: self.objects.get(path), lambda found: is_whole(found, expected))

    def get_array(self, job: str, name: str, expected: Expected = None) -> NDArray[Any]:
        """Return a result of a job that is an .npy file, for reading."""
        return self.objects.array(f"{job}/{name}", expected)

    def get_rows(self, job: str, name: str, expected: Expected = None) -> StoredRows:
        """Open a result of a job that is an .npy file, to read some of its rows."""
        stored = self.objects.find(path := f"{job}/{name}")
        if stored is None:
            raise FileNotFoundError(errno.ENOENT, "There is no such file", path)
        return StoredRows(path, checked(path, stored, expected))

    def find(self, job: str, name: str) -> Stored | None:
        """Describe a result of a job; None if there is none."""
        return self.objects.find(f"{job}/{name}")

    def put_samples(self, job: str, pass_index: int, tile: Tile, attempt: int, samples: Layers) -> None:
        """Keep the samples that a pass of target quality has taken in a tile."""
        _put_arrays(self.objects, _samples_name(job, pass_index, tile, attempt), samples)

    def get_samples(self, job: str, pass_index: int, parts: Sequence[StoredTile]) -> Iterator[Layers]:
        """Return the samples of several tiles; raise StoreDamagedError if they are not what was written."""
        names = [_samples_name(job, pass_index, part.tile, part.attempt) for part in parts]
        return _get_arrays(self.objects, names)

    def put_state(self, job: str, pass_index: int, attempt: int, state: Layers) -> Checksums:
        """Keep the estimate after a pass."""
        name = _pass_name(pass_index, "state", attempt)
        with self.objects.draft(f"{job}/{name}") as draft:
            _write_arrays(draft, state)
            return self._keep(draft, job, name)

    def get_state(
        self, job: str, pass_index: int, attempt: int, checksums: Checksums = NO_CHECKSUMS
    ) -> Layers:
        """Return the estimate after a pass; raise StoreDamagedError if it is not what was written."""
        name = _pass_name(pass_index, "state", attempt)
        return _arrays(f"{job}/{name}", self.get_file(job, name, checksums.get(name)))

    def put_map(
        self, job: str, pass_index: int, attempt: int, kind: PassMap, array: NDArray[Any]
    ) -> Checksums:
        """Keep an array over the pixels that the next pass, or a reader of the picture, needs."""
        name = _pass_name(pass_index, kind, attempt)
        with self.objects.draft(f"{job}/{name}") as draft:
            np.save(draft, array)
            return self._keep(draft, job, name)

    def get_map(
        self, job: str, pass_index: int, attempt: int, kind: PassMap, checksums: Checksums = NO_CHECKSUMS
    ) -> NDArray[Any]:
        """Return what ``put_map`` was given, read-only."""
        name = _pass_name(pass_index, kind, attempt)
        return self.get_array(job, name, checksums.get(name))

    def get_map_rows(
        self, job: str, pass_index: int, attempt: int, kind: PassMap, checksums: Checksums = NO_CHECKSUMS
    ) -> StoredRows:
        """Open what ``put_map`` was given, to read some of its rows."""
        name = _pass_name(pass_index, kind, attempt)
        return self.get_rows(job, name, checksums.get(name))

    def _keep(self, draft: IO[bytes], job: str, name: str) -> Checksums:
        checksum = checksum_of_file(draft)
        self.objects.keep(draft, f"{job}/{name}")
        return {name: checksum}

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
            All jobs; files of no job are removed once they have this age.
        ended
            Jobs that need no tiles any more, with the prefix of their final files, or None if there is no
            picture: final files of other attempts are removed.
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


def damaged_steps(parts: Iterable[StoredTile], read: Callable[[StoredTile], object]) -> list[Step]:
    """Return the steps whose files are damaged or missing, by reading each of them."""
    return [(part.pass_.index, part.tile.index) for part in parts if is_lost(partial(read, part))]


def _put_arrays(objects: Objects, name: str, arrays: Layers) -> None:
    """Keep arrays as one .npz file."""
    with objects.draft(name) as draft:
        _write_arrays(draft, arrays)
        objects.keep(draft, name)


def _write_arrays(file: IO[bytes], arrays: Layers) -> None:
    members: dict[str, Any] = dict(arrays)
    np.savez(file, **members)


def _get_arrays(objects: Objects, names: Sequence[str]) -> Iterator[Layers]:
    """Return the arrays of several .npz files; raise StoreDamagedError if one is not what was written."""
    return (_arrays(name, data) for name, data in zip(names, objects.many(names), strict=True))


def _arrays(name: str, data: bytes) -> Layers:
    with damage_reported(name), np.load(io.BytesIO(data), allow_pickle=False) as found:
        # Every member has a CRC-32, which is checked, and their list has none: the end has their number.
        if len(found.files) != int.from_bytes(data[MEMBER_COUNT], "little"):
            raise ValueError("a member is missing")
        return dict(found)


def _name(job: str, tile: Tile, pass_: Pass, attempt: int) -> str:
    return f"{job}/{pass_prefix(pass_.index)}{tile.index}.{attempt}"


def _unfinished_name(job: str, tile: Tile, pass_: Pass) -> str:
    return f"{job}/{pass_prefix(pass_.index)}{tile.index}{UNFINISHED_SUFFIX}"


def tile_name(job: str, part: StoredTile) -> str:
    """Return the name of the pixels of a step."""
    return _name(job, part.tile, part.pass_, part.attempt)


def _pixels(job: str, part: StoredTile, data: bytes) -> Pixels:
    if zlib.crc32(data) != part.crc32:
        raise StoreDamagedError(tile_name(job, part))
    return np.frombuffer(data, dtype="<f4").reshape(part.shape)


def _shape(tile: Tile, pass_: Pass) -> tuple[int, int, int]:
    height, width = tile.y1 - tile.y0, tile.x1 - tile.x0
    return -(-height // pass_.stride), -(-width // pass_.stride), 3


def _samples_name(job: str, pass_index: int, tile: Tile, attempt: int) -> str:
    return f"{job}/{pass_prefix(pass_index)}{tile.index}.{attempt}{SAMPLES_SUFFIX}"


def pass_prefix(pass_index: int) -> str:
    """Return what the names of all files of a pass begin with."""
    return f"{TILES}/{pass_index}-"


def _pass_name(pass_index: int, kind: str, attempt: int) -> str:
    return f"{pass_prefix(pass_index)}{kind}.{attempt}"


def _is_before(name: str, pass_index: int) -> bool:
    number, _, rest = name.partition("-")
    return number.isdecimal() and int(number) < pass_index and not rest.endswith(LAYERS_SUFFIX)
