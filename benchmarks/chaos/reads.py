"""Pictures and tiles of running jobs, read over many connections while workers write them."""

from __future__ import annotations

import hashlib
import io
import itertools
import json
import multiprocessing
import time
from collections import defaultdict
from contextlib import closing
from dataclasses import dataclass, field
from http import HTTPStatus
from http.client import HTTPConnection, HTTPException
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import numpy as np
from PIL import Image

from benchmarks.bursts import SIDE
from benchmarks.chaos.ground import LONGEST, picture, settings
from benchmarks.load.promises import Promise
from schemas.api import batches
from service.server import running

if TYPE_CHECKING:
    from collections.abc import Sequence

SAMPLES = 144
"""Camera samples of a pixel: the picture grows in five passes."""
NEWEST = 2**31
"""Stands for the newest event of a picture that is final."""
WAYS = ("image.npy", "tiles?after=0", "image.png")


@dataclass(frozen=True)
class Read:
    """One answer: of which picture, up to which event, and when it was requested and received, seconds."""

    number: int
    newest: int
    asked: float
    there: float


@dataclass
class Seen:
    """What one reader, or all of them, have seen.

    Attributes
    ----------
    digests : dict
        What was read under each name: there should be one digest for each.
    torn : int
        Answers that are no whole picture or batch, or not what their name says.
    """

    reads: list[Read] = field(default_factory=list)
    digests: dict[str, set[bytes]] = field(default_factory=dict)
    torn: int = 0

    def note(self, name: str, data: bytes | memoryview) -> None:
        """Remember what stood under a name."""
        self.digests.setdefault(name, set()).add(hashlib.sha256(data).digest())


def reads_over_http(reads: int, readers: int = 4) -> Promise:
    """Have processes read what is there of the same pictures while they are rendered."""
    with (
        TemporaryDirectory() as folder,
        running(settings(Path(folder), workers=1)) as server,
        multiprocessing.get_context("spawn").Pool(readers) as pool,
    ):
        begun = time.monotonic()
        parts = pool.starmap(_read, [(server.url, reads // readers)] * readers)
        seconds = time.monotonic() - begun
    found = [read for part in parts for read in part.reads]
    digests: defaultdict[str, set[bytes]] = defaultdict(set)
    for name, some in itertools.chain.from_iterable(part.digests.items() for part in parts):
        digests[name] |= some
    torn = sum(part.torn for part in parts) + sum(len(some) > 1 for some in digests.values())
    older = outdated(found)
    growing = sum(read.newest != NEWEST for read in found)
    return Promise(
        promise="no reader over HTTP gets a torn picture or tile, or an older pass after a newer one",
        measured=f"{len(found)} reads over {readers} connections, {growing} of them of pictures that grew: "
        f"{torn} torn, {older} older",
        held=torn == older == 0 and growing > 0,
        limit="0 torn, 0 older",
        details={
            "reads": len(found),
            "growing": growing,
            "readers": readers,
            "pictures": len({read.number for read in found}),
            "states": len(digests),
            "seconds": round(seconds, 1),
            "torn": torn,
            "older": older,
        },
    )


def outdated(reads: Sequence[Read]) -> int:
    """Count the reads that show less than one that was complete before they were requested.

    Examples
    --------
    >>> first, second = Read(0, 7, 0.0, 1.0), Read(0, 6, 2.0, 3.0)
    >>> outdated([first, second]), outdated([second, Read(0, 7, 2.5, 2.6)])
    (1, 0)
    """
    newest: defaultdict[int, int] = defaultdict(int)
    there, place, found = sorted(reads, key=attrgetter("there")), 0, 0
    for read in sorted(reads, key=attrgetter("asked")):
        while there[place].there < read.asked:
            earlier = there[place]
            newest[earlier.number] = max(newest[earlier.number], earlier.newest)
            place += 1
        found += read.newest < newest[read.number]
    return found


def _read(url: str, reads: int) -> Seen:
    """Follow one picture after the other until so many reads are done; all readers share the same."""
    seen = Seen()
    with closing(HTTPConnection(urlsplit(url).netloc, timeout=LONGEST)) as connection:
        for number in itertools.count():
            job = _submitted(connection, number)
            for way in itertools.cycle(WAYS):
                newest = _look(connection, seen, number, job, way)
                if len(seen.reads) + seen.torn >= reads:
                    return seen
                if newest == NEWEST:
                    break
    raise AssertionError("unreachable")


def _submitted(connection: HTTPConnection, number: int) -> str:
    document = json.dumps({"scene": picture(number, samples=SAMPLES)})
    connection.request("POST", "/v1/jobs", document, {"Content-Type": "application/json"})
    return str(json.loads(connection.getresponse().read())["id"])


def _look(connection: HTTPConnection, seen: Seen, number: int, job: str, way: str) -> int:
    """Read a picture, or its tiles, in one way; give the newest event in it."""
    asked = time.monotonic()
    try:
        connection.request("GET", f"/v1/jobs/{job}/{way}", headers={"Accept": batches.MEDIA_TYPE})
        answer = connection.getresponse()
        data = answer.read()
        there = time.monotonic()
        if answer.status == HTTPStatus.NOT_FOUND:
            # Nothing of it is finished yet.
            return 0
        if answer.status != HTTPStatus.OK:
            raise ValueError(f"The answer is {answer.status}.")
        if way.startswith("tiles"):
            newest = _tiles(seen, number, data)
        else:
            newest = _picture(seen, number, job, answer.headers["ETag"], data)
    except (ValueError, OSError, HTTPException):
        seen.torn += 1
        return 0
    seen.reads.append(Read(number, newest, asked, there))
    return newest


def _tiles(seen: Seen, number: int, data: bytes) -> int:
    head, tiles = batches.unpack(data)
    for tile, pixels in tiles:
        seen.note(f"{number}: tile of event {tile.seq}", pixels)
    return NEWEST if head.complete else head.next


def _picture(seen: Seen, number: int, job: str, etag: str, data: bytes) -> int:
    """Decode a picture; a final one in floats has its digest in its name."""
    if etag.endswith('.npy"'):
        pixels = np.load(io.BytesIO(data))
        whole = pixels.shape == (SIDE, SIDE, 3) and bool(np.isfinite(pixels).all())
    else:
        with Image.open(io.BytesIO(data)) as shown:
            shown.load()
            whole = shown.size == (SIDE, SIDE)
    state, kind = etag.strip('"').removeprefix(f"{job}-").rsplit("-", 1)
    final = not state.isdecimal()
    seen.note(f"{number}: {kind} of {state}", data)
    digest = hashlib.sha256(data).hexdigest()
    if not whole or (final and kind.endswith(".npy") and digest != state):
        raise ValueError("This is not the picture that it is called.")
    return NEWEST if final else int(state)
