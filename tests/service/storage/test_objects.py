"""Objects in a folder and in a bucket, and the assets among them."""

import asyncio
import hashlib
import io
import os
import resource
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image

from renderer.images.files import encode_layer
from schemas.limits import Limits
from service.errors import StoreAwayError, StoreDamagedError, UploadMismatchError
from service.storage.assets import AssetStore
from service.storage.bucket import CALL_SECONDS, PART_BYTES
from service.storage.checksums import Checksum
from service.storage.folder import Folder, place_of
from service.storage.objects import Objects
from service.storage.tiles import TileStore
from tests.s3_server import BUCKET, S3Server
from tests.service.flaky import Change, Flaky
from tests.service.support import until

GARBLED = f"s3://{BUCKET}/garbled"
LATER = timedelta(hours=1)


def names(place: Objects, prefix: str = "") -> set[str]:
    return {found.name for found in place.found(prefix)}


def test_bytes_come_back_whole_in_part_and_many_at_once(place: Objects) -> None:
    place.begin("a/b")
    sent = {f"a/b/{number}": bytes([number]) * number for number in range(70)}
    for name, data in sent.items():
        place.put(name, data)
    assert place.get("a/b/7") == sent["a/b/7"]
    assert list(place.many(list(sent))) == list(sent.values())
    stored = place.find("a/b/69")
    assert stored is not None
    assert (stored.size, stored.read(3, 9)) == (69, bytes([69]) * 6)
    assert abs(stored.modified - datetime.now(UTC).timestamp()) < 600
    assert {(found.name, found.size) for found in place.found("a")} == {
        (name, len(data)) for name, data in sent.items()
    }
    assert names(place.within("a")) == {name.removeprefix("a/") for name in sent}


def test_drop_leaves_names_beside_a_name(place: Objects) -> None:
    for job in ("a", "ab"):
        place.begin(f"{job}/tiles")
        place.put(f"{job}/tiles/1", b"x")
        place.put(f"{job}/spec", b"y")
    place.drop("a/tiles")
    until(lambda: names(place) == {"a/spec", "ab/tiles/1", "ab/spec"})
    place.drop("ab")
    until(lambda: names(place) == {"a/spec"})


def test_object_that_is_dropped_is_read_to_its_end_or_missing(place: Objects) -> None:
    place.begin("a")
    place.put("a/b", b"abc")
    stored = place.find("a/b")
    assert stored is not None
    place.drop("a")
    until(lambda: place.find("a/b") is None)
    if isinstance(place, Folder):
        assert stored.read(0, 3) == b"abc"
    else:
        with pytest.raises(FileNotFoundError):
            stored.read(0, 3)


def test_draft_is_seen_once_it_is_kept(place: Objects) -> None:
    for kept in (False, True):
        with place.draft("a") as draft:
            draft.write(b"abc")
            assert place.find("a") is None
            if kept:
                place.keep(draft, "a")
    assert place.get("a") == b"abc"
    assert names(place) == {"a"}


@pytest.mark.parametrize("size", [PART_BYTES, PART_BYTES + 1, 2 * PART_BYTES + 17])
def test_large_object_comes_back_whole(place: Objects, size: int) -> None:
    data = np.random.default_rng(size).bytes(size)
    place.put("large", data)
    assert place.get("large") == data
    assert list(place.many(["large", "large"])) == [data, data]


async def pieces(data: bytes) -> AsyncIterator[bytes]:
    for start in range(0, len(data), 10):
        yield data[start : start + 10]


def test_asset_is_kept_under_its_hash(place: Objects) -> None:
    file = io.BytesIO()
    Image.new("RGB", (2, 2), (9, 8, 7)).save(file, "PNG")
    store, data = AssetStore(place, Limits(max_image_pixels=100)), file.getvalue()
    sha256 = hashlib.sha256(data).hexdigest()
    with pytest.raises(UploadMismatchError):
        asyncio.run(store.receive("0" * 64, pieces(data)))
    assert names(place) == set()
    size, header = asyncio.run(store.receive(sha256, pieces(data)))
    assert (size, header.media_type, header.width) == (len(data), "image/png", 2)
    assert store.read(f"sha256:{sha256}") == data
    with pytest.raises(KeyError):
        store.read(f"sha256:{'0' * 64}")
    now = datetime.now(UTC)
    store.drop([sha256], now - LATER)
    store.sweep(set(), now - LATER, 3600.0)
    store.sweep({sha256}, now + LATER, 3600.0)
    assert names(place) == {sha256}
    store.sweep(set(), now + LATER, 3600.0)
    assert names(place) == set()


def test_damaged_asset_is_set_aside_and_swept(place: Objects) -> None:
    data = b"v 0 0 0"
    sha256, store = hashlib.sha256(data).hexdigest(), AssetStore(place, Limits())
    place.put(sha256, b"changed")
    with pytest.raises(KeyError):
        store.read(f"sha256:{sha256}")
    assert names(place) == {f"{sha256}.damaged"}
    now = datetime.now(UTC)
    store.sweep({sha256}, now - LATER, 3600.0)
    assert names(place) == {f"{sha256}.damaged"}
    store.sweep({sha256}, now + LATER, 3600.0)
    assert names(place) == set()


def test_damaged_asset_stays_where_no_file_can_be_opened(tmp_path: Path) -> None:
    """An error that passes deletes nothing."""
    store, sha256 = AssetStore(Folder(tmp_path), Limits()), "0" * 64
    (tmp_path / sha256).write_bytes(b"changed")
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    following = os.dup(0)
    os.close(following)
    # One file more: the one that is found to have another size.
    resource.setrlimit(resource.RLIMIT_NOFILE, (following + 1, limits[1]))
    try:
        with pytest.raises(OSError, match="Too many open files"):
            store.find(sha256, 99)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)
    assert (tmp_path / sha256).read_bytes() == b"changed"


@pytest.mark.usefixtures("object_store")
def test_missing_bucket_is_reported() -> None:
    with pytest.raises(StoreAwayError, match="AWS_ENDPOINT_URL"):
        place_of("s3://penumbra-nowhere").check()
    with pytest.raises(StoreAwayError):
        place_of("s3://penumbra-nowhere").put("a", b"")


def test_file_that_the_disk_does_not_read_is_damaged(tmp_path: Path) -> None:
    """Nothing is mapped at the beginning of this process's memory: reading there is EIO."""
    (tmp_path / "a").symlink_to("/proc/self/mem")
    place = Folder(tmp_path)
    stored = place.find("a")
    assert stored is not None
    for read in (lambda: place.get("a"), lambda: stored.read(0, 9)):
        with pytest.raises(StoreDamagedError):
            read()


READERS: dict[str, Callable[[TileStore, str, Checksum], bytes]] = {
    "whole": lambda store, name, checksum: store.get_file("job", name, checksum),
    "array": lambda store, name, checksum: store.get_array("job", name, checksum).tobytes(),
    "rows": lambda store, name, checksum: store.get_rows("job", name, checksum).read(0, 40_000).tobytes(),
}


@pytest.mark.parametrize("read", READERS.values(), ids=READERS)
def test_garbled_answer_of_a_bucket_is_asked_for_again(
    object_store: S3Server, monkeypatch: pytest.MonkeyPatch, read: Callable[[TileStore, str, Checksum], bytes]
) -> None:
    parts = urlsplit(object_store.url)
    way = Flaky((str(parts.hostname), parts.port or 0))
    monkeypatch.setenv("AWS_ENDPOINT_URL", way.url)
    values = np.random.default_rng(1).integers(0, 256, 40_000, np.uint8)
    [(name, checksum)] = (
        TileStore(place_of(GARBLED)).put_final("job", 1, "x.npy", encode_layer(values)).items()
    )
    # Another store has connections of its own, of which the first one garbles its answers.
    way.faults.append(Change(after=20_000))
    try:
        found = read(TileStore(place_of(GARBLED)), name, checksum)
    finally:
        way.close()
    assert found.endswith(values.tobytes())
    assert not way.faults


CALLS: dict[str, Callable[[Objects], object]] = {
    "check": lambda place: place.check(),
    "find": lambda place: place.find("small"),
    "get": lambda place: place.get("small"),
    "many": lambda place: list(place.many(["small"] * 40)),
    "found": lambda place: list(place.found()),
    "put": lambda place: place.put("other", b"other"),
    "delete": lambda place: place.delete(["small"]),
}


@pytest.mark.slow
def test_call_of_a_silent_bucket_is_given_up(object_store: S3Server) -> None:
    place = place_of(f"s3://{BUCKET}/calls")
    place.put("small", b"small")
    object_store.stall()
    try:
        with ThreadPoolExecutor(len(CALLS)) as pool:
            calls = {name: pool.submit(call, place) for name, call in CALLS.items()}
            # Far less than the 30 seconds after which the bucket's library gives up.
            errors = {name: call.exception(3 * CALL_SECONDS) for name, call in calls.items()}
    finally:
        object_store.resume()
    assert {name: type(error) for name, error in errors.items()} == dict.fromkeys(CALLS, StoreAwayError)
    place.put("after", b"after")
    assert place.get("after") == b"after"
