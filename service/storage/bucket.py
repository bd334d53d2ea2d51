"""A bucket of an S3-compatible object store, for machines without a common folder.

Who may use it, and where it is, comes from the variables ``AWS_ACCESS_KEY_ID``, ``AWS_SECRET_ACCESS_KEY``,
``AWS_REGION``, ``AWS_ENDPOINT_URL`` and others, or from the machine's role.
"""

from __future__ import annotations

import asyncio
import io
import os
import queue
import tempfile
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import IO, Any
from urllib.parse import urlsplit

import numpy as np
from numpy.typing import NDArray

from service.errors import StoreAwayError, StoreMissingError
from service.storage.checksums import Expected, damage_reported, is_whole, read_checked
from service.storage.folder import translate_errors
from service.storage.objects import Found, Stored
from service.supervision import SupervisedThread

# Each thread takes some of a worker's limited address space, so only a few may wait for the network.
os.environ.setdefault("TOKIO_WORKER_THREADS", "2")
try:
    import obstore
    from obstore.exceptions import BaseError
    from obstore.store import S3Store
except ImportError:
    raise StoreMissingError from None

ENDPOINTS = ("AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL", "AWS_ENDPOINT")
AT_ONCE = 32
"""Small objects that are fetched at the same time."""
SMALL_BYTES = 256 << 10
RECENT_BYTES = 256 << 20
# Longest request, with its body, seconds.
CALL_SECONDS = 5
# Seconds of outage after which jobs wait and requests fail; less than a request, so that no hung one is
# retried.
RETRY_SECONDS = 4
# Other objects are moved in parts of this size, the smallest that S3 takes, so that a slow network fails no
# large picture: 16 Mbit/s are enough for two of them at once, and for as many small objects as there are.
PART_BYTES = 5 << 20
PARTS_AT_ONCE = 2
# Seconds before the next try to remove objects.
DROP_SECONDS = 5.0


class Bucket:
    """One object for each name. Satisfies ``Objects``.

    Parameters
    ----------
    place : str
        ``s3://bucket`` or ``s3://bucket/prefix``.

    Raises
    ------
    StoreAwayError
        If the variables contradict each other.
    """

    def __init__(self, place: str) -> None:
        self.place = place.rstrip("/")
        parts = urlsplit(self.place)
        endpoint = next((os.environ[name] for name in ENDPOINTS if os.environ.get(name)), "")
        try:
            self._store = S3Store(
                parts.netloc,
                prefix=parts.path.strip("/") or None,
                # The scheme of an endpoint says whether to use TLS.
                client_options={
                    "allow_http": endpoint.startswith("http://"),
                    "connect_timeout": "3s",
                    "timeout": f"{CALL_SECONDS}s",
                },
                retry_config={"max_retries": 2, "retry_timeout": timedelta(seconds=RETRY_SECONDS)},
            )
        except BaseError as error:
            raise self._unusable(error) from error
        self._recent = Recent(RECENT_BYTES)
        self._unwanted: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._dropping: SupervisedThread | None = None

    def within(self, name: str) -> Bucket:
        """Return the part of the store under a name, as a store."""
        return Bucket(f"{self.place}/{name}")

    def check(self) -> None:
        """Raise StoreAwayError if it cannot be listed from here; the message says what to do."""
        try:
            next(iter(obstore.list(self._store, chunk_size=1)), None)
        except (BaseError, FileNotFoundError) as error:
            raise self._unusable(error) from error

    def begin(self, prefix: str) -> None:
        """Do nothing: a bucket has no folders. Late writes are deleted at the next start of the service."""

    def put(self, name: str, data: bytes, *, durable: bool = False) -> None:  # noqa: ARG002  (it always is)
        """Store bytes under a name, replacing what was there."""
        self._put(name, data)

    @contextmanager
    def draft(self, name: str) -> Iterator[IO[bytes]]:
        """Open a temporary file of this machine."""
        with translate_errors(), tempfile.NamedTemporaryFile(suffix=Path(name).suffix) as file:
            yield file

    def keep(self, draft: IO[bytes], name: str, *, durable: bool = False) -> None:  # noqa: ARG002
        """Send what was written to a draft."""
        with translate_errors():
            draft.flush()
        self._put(name, Path(draft.name))

    def get(self, name: str) -> bytes:
        """Return all bytes; raise FileNotFoundError if there are none."""
        return next(self.many([name]))

    def many(self, names: Sequence[str]) -> Iterator[bytes]:
        """Return the bytes of several names in their order, fetching some of them in parallel."""
        for first in range(0, len(names), AT_ONCE):
            with self._translate_errors():
                fetched = asyncio.run(self._fetched(names[first : first + AT_ONCE]))
            yield from fetched

    def array(self, name: str, expected: Expected = None) -> NDArray[Any]:
        """Return an array, fetched whole."""
        return self._recent.get(name, lambda: self._array(name, expected))

    def _array(self, name: str, expected: Expected) -> NDArray[Any]:
        content = read_checked(name, partial(self.get, name), partial(is_whole, expected=expected))
        with damage_reported(name):
            found: NDArray[Any] = np.load(io.BytesIO(content))
        return found

    def find(self, name: str) -> Stored | None:
        """Describe what is stored under a name; None if there is nothing."""
        try:
            with self._translate_errors():
                head = obstore.head(self._store, name)
        except FileNotFoundError:
            return None
        modified = head["last_modified"].timestamp()
        return Stored(head["size"], modified, lambda start, end: self._part(name, start, end))

    def found(self, prefix: str = "") -> Iterator[Found]:
        """List all objects under a name, or all."""
        with self._translate_errors():
            for page in obstore.list(self._store, prefix or None):
                for one in page:
                    yield Found(one["path"], one["size"], one["last_modified"].timestamp())

    def delete(self, names: Iterable[str]) -> None:
        """Remove objects; those that are not there do not matter."""
        unwanted = list(names)
        if unwanted:
            with self._translate_errors(), suppress(FileNotFoundError):
                obstore.delete(self._store, unwanted)

    def drop(self, prefix: str) -> None:
        """Remove all objects under a name in a thread, which retries until the bucket answers.

        Objects left at the end of the process are deleted at the next start of the service.
        """
        self._unwanted.put(prefix)
        if self._dropping is None:
            self._dropping = SupervisedThread("bucket", self._drop)
            self._dropping.start()

    def tidy(self, age_seconds: float) -> None:
        """Do nothing: drafts are elsewhere, and have no names."""

    def _drop(self) -> None:
        while True:
            prefix = self._unwanted.get()
            while not self._dropped(prefix):
                time.sleep(DROP_SECONDS)

    def _dropped(self, prefix: str) -> bool:
        try:
            self.delete(found.name for found in self.found(prefix))
        except StoreAwayError:
            return False
        return True

    def _put(self, name: str, content: bytes | Path) -> None:
        try:
            with self._translate_errors():
                obstore.put(self._store, name, content, chunk_size=PART_BYTES, max_concurrency=PARTS_AT_ONCE)
        except FileNotFoundError as error:
            raise StoreAwayError("There is no such bucket any more.") from error

    def _part(self, name: str, start: int, end: int) -> bytes:
        with self._translate_errors():
            return bytes(obstore.get_range(self._store, name, start=start, end=end))

    async def _fetched(self, names: Sequence[str]) -> list[bytes]:
        turn = asyncio.Semaphore(PARTS_AT_ONCE)
        return await asyncio.gather(*(self._fetch(name, turn) for name in names))

    async def _fetch(self, name: str, turn: asyncio.Semaphore) -> bytes:
        """Fetch an object: a small one with one request, others in parts, few at once."""
        found = await obstore.get_async(self._store, name)
        size = found.meta["size"]
        if size <= SMALL_BYTES:
            return bytes(await found.bytes_async())
        # The rest of the first answer is dropped with its connection.
        del found
        return b"".join(await asyncio.gather(*(self._fetch_part(name, s, e, turn) for s, e in _parts(size))))

    async def _fetch_part(self, name: str, start: int, end: int, turn: asyncio.Semaphore) -> bytes:
        async with turn:
            return bytes(await obstore.get_range_async(self._store, name, start=start, end=end))

    def _unusable(self, error: Exception) -> StoreAwayError:
        cure = "Check the name of the bucket, AWS_ENDPOINT_URL and the other AWS variables."
        return StoreAwayError(f"{self.place} cannot be used: {str(error).splitlines()[0]}. {cure}")

    @contextmanager
    def _translate_errors(self) -> Iterator[None]:
        """Log why a bucket cannot be used, and raise an error that asks for another try."""
        try:
            yield
        except BaseError as error:
            import structlog  # noqa: PLC0415 - workers start without it, and few ever log

            reason = str(error).splitlines()[0]
            structlog.get_logger().warning("object store unavailable", store=self.place, error=reason)
            message = "The object store cannot be used now. Try again in a moment."
            raise StoreAwayError(message) from error


def _parts(size: int) -> Iterator[tuple[int, int]]:
    """Yield where the parts of an object begin and end, bytes."""
    for start in range(0, size, PART_BYTES):
        yield start, min(start + PART_BYTES, size)


class Recent:
    """Caches arrays, so that each is fetched once and not for every tile.

    Parameters
    ----------
    most_bytes : int
        Size of the cache; a larger array is not cached.
    """

    def __init__(self, most_bytes: int) -> None:
        self._most = most_bytes
        self._arrays: OrderedDict[str, NDArray[Any]] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, name: str, fetch: Callable[[], NDArray[Any]]) -> NDArray[Any]:
        """Return the array of a name, fetched unless it is here. It is read-only."""
        with self._lock:
            if name in self._arrays:
                self._arrays.move_to_end(name)
                return self._arrays[name]
        array = fetch()
        array.flags.writeable = False
        with self._lock:
            self._arrays[name] = array
            while sum(kept.nbytes for kept in self._arrays.values()) > self._most:
                self._arrays.popitem(last=False)
        return array
