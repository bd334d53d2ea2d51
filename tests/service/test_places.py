"""A folder and a bucket behave the same, and so do the stores that use them."""

from __future__ import annotations

import asyncio
import hashlib
import io
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from sqlalchemy import select

from schemas.api.jobs import JobState
from schemas.limits import Limits
from schemas.tiles import Pass, Tile
from service.errors import StoreAwayError, StoreDamagedError, StoreTakenError, UploadMismatchError
from service.storage import ownership
from service.storage.assets import AssetStore
from service.storage.bucket import PART_BYTES
from service.storage.database.connection import Database
from service.storage.database.models import LeaderRow, RenderRow
from service.storage.folder import place_of
from service.storage.objects import Objects
from service.storage.tiles import StoredTile, TileStore
from tests.s3_server import BUCKET, S3Server
from tests.service.support import BOTH, until

NUMBERS = count()
TILE, PASS = Tile(0, 0, 0, 4, 3), Pass(1, 1, 0, 1)
LATER = timedelta(hours=1)


@pytest.fixture(params=["folder", "bucket"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Objects:
    """An empty place of each kind."""
    if request.param == "folder":
        found = place_of(str(tmp_path))
        found.begin("")
        return found
    request.getfixturevalue("object_store")
    return place_of(f"s3://{BUCKET}/places-{next(NUMBERS)}")


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


def test_what_is_not_there_is_reported_as_missing(place: Objects) -> None:
    assert place.find("a") is None
    assert names(place, "a") == set()
    for read in (place.get, place.array, lambda name: list(place.many([name]))):
        with pytest.raises(FileNotFoundError):
            read("a")
    place.delete(["a"])


def test_names_beside_a_name_stay_when_it_is_dropped(place: Objects) -> None:
    for job in ("a", "ab"):
        place.begin(f"{job}/tiles")
        place.put(f"{job}/tiles/1", b"x")
        place.put(f"{job}/spec", b"y")
    place.drop("a/tiles")
    until(lambda: names(place) == {"a/spec", "ab/tiles/1", "ab/spec"})
    place.drop("ab")
    until(lambda: names(place) == {"a/spec"})


def test_a_draft_is_seen_when_it_is_kept_and_goes_otherwise(place: Objects) -> None:
    for kept in (False, True):
        with place.draft("a") as draft:
            draft.write(b"abc")
            assert place.find("a") is None
            if kept:
                place.keep(draft, "a")
    assert place.get("a") == b"abc"
    assert names(place) == {"a"}


def test_an_array_is_read_whatever_was_written_before_it(place: Objects) -> None:
    array = np.arange(24, dtype=np.float32).reshape(2, 4, 3)
    with place.draft("a.npy") as draft:
        np.save(draft, array)
        place.keep(draft, "a.npy")
    for _ in range(2):
        np.testing.assert_array_equal(place.array("a.npy")[:, 1:3], array[:, 1:3])
    with pytest.raises(ValueError, match="read-only"):
        place.array("a.npy")[0, 0, 0] = 1


@pytest.mark.parametrize("size", [PART_BYTES, PART_BYTES + 1, 2 * PART_BYTES + 17])
def test_large_contents_come_back_whole(place: Objects, size: int) -> None:
    data = np.random.default_rng(size).bytes(size)
    place.put("large", data)
    assert place.get("large") == data
    assert list(place.many(["large", "large"])) == [data, data]


def test_an_old_attempt_overwrites_nothing(place: Objects) -> None:
    store = TileStore(place)
    store.put_spec("job", b"{}")
    newest, stale = (np.full((3, 4, 3), value, np.float32) for value in (2, 1))
    part = StoredTile(TILE, PASS, 2, store.put_tile("job", TILE, PASS, 2, newest))
    store.put_tile("job", TILE, PASS, 1, stale)
    np.testing.assert_array_equal(store.get_tile("job", part), newest)
    assert store.get_spec("job") == b"{}"


def test_a_damaged_tile_is_noticed(place: Objects) -> None:
    store = TileStore(place)
    store.put_spec("job", b"{}")
    part = StoredTile(TILE, PASS, 1, store.put_tile("job", TILE, PASS, 1, np.ones((3, 4, 3), np.float32)))
    store.put_layers("job", TILE, PASS, 1, {"depth": np.ones((3, 4), np.float32)})
    for name in ("1-0.1", "1-0.1.npz"):
        data = place.get(f"job/tiles/{name}")
        place.put(f"job/tiles/{name}", data[: len(data) // 2])
    with pytest.raises(StoreDamagedError):
        store.get_tile("job", part)
    with pytest.raises(StoreDamagedError):
        next(store.get_layers("job", [part]))


def test_a_sweep_leaves_what_jobs_need(place: Objects) -> None:
    store = TileStore(place)
    for job in ("running", "ended", "unknown"):
        store.put_spec(job, b"{}")
        store.put_tile(job, TILE, PASS, 1, np.ones((3, 4, 3), np.float32))
    assert store.sizes() == dict.fromkeys(("running", "ended", "unknown"), 2 + 4 * 36)
    store.sweep({"running", "ended"}, {"ended": None}, 3600.0)
    until(lambda: "ended/tiles/1-0.1" not in names(place))
    assert "unknown/spec.json" in names(place)
    store.sweep({"running", "ended"}, {"ended": None}, 0.0)
    until(lambda: names(place) == {"running/spec.json", "running/tiles/1-0.1", "ended/spec.json"})


@pytest.mark.parametrize(
    ("prefix", "left"),
    [
        ("2-", {"2-image.npy", "2-image-96.png", "2-layer-depth.npy"}),
        ("", {"image.npy", "image-96.png", "layer-depth.npy"}),
        (None, set()),
    ],
    ids=["attempt", "of version 0.1", "no picture"],
)
def test_final_files_that_no_row_records_go_and_the_others_stay(
    place: Objects, prefix: str | None, left: set[str]
) -> None:
    store = TileStore(place)
    for job in ("ended", "running"):
        store.put_spec(job, b"{}")
        for attempt in ("", "1-", "2-", "12-"):
            for name in ("image.npy", "image-96.png", "layer-depth.npy"):
                store.put_file(job, f"{attempt}{name}", b"final")
    before = names(place, "running")
    store.sweep({"running", "ended"}, {"ended": prefix}, 3600.0)
    assert names(place, "ended") == {f"ended/{name}" for name in {"spec.json", *left}}
    assert names(place, "running") == before


def test_passes_that_are_merged_go_and_their_layers_stay(place: Objects) -> None:
    store = TileStore(place)
    store.put_spec("job", b"{}")
    for index in (9, 10):
        store.put_layers("job", TILE, Pass(index, 1, 0, 1), 1, {"depth": np.ones((3, 4))})
        store.put_samples("job", index, TILE, 1, {"colors": np.full(5, index)})
        store.put_state("job", index, 1, {"have": np.full(5, index)})
        store.put_map("job", index, 1, "picture", np.full((3, 4, 3), index, np.float32))
    store.drop_passes_before("job", 10)
    assert names(place, "job/tiles") == {
        f"job/tiles/{name}"
        for name in ("9-0.1.npz", "10-0.1.npz", "10-0.1.samples", "10-state.1", "10-picture.1")
    }
    [samples] = store.get_samples("job", 10, [StoredTile(TILE, PASS, 1, 0)])
    assert samples["colors"].tolist() == [10] * 5
    assert store.get_state("job", 10, 1)["have"].tolist() == [10] * 5
    assert float(store.get_map("job", 10, 1, "picture").mean()) == 10


def png() -> bytes:
    file = io.BytesIO()
    Image.new("RGB", (2, 2), (9, 8, 7)).save(file, "PNG")
    return file.getvalue()


async def pieces(data: bytes) -> AsyncIterator[bytes]:
    for place in range(0, len(data), 10):
        yield data[place : place + 10]


def test_an_asset_is_kept_under_its_hash_alone(place: Objects) -> None:
    store, data = AssetStore(place, Limits(max_image_pixels=100)), png()
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


@BOTH
def test_a_place_belongs_to_one_database(place: Objects, database: Database) -> None:
    for _ in range(2):
        ownership.check(database, place)
    with pytest.raises(StoreTakenError, match="database-id"):
        ownership.check(database, place.within("other"))


@BOTH
@pytest.mark.parametrize("name", ["jobs/ab/spec.json", "database-id"])
def test_a_new_database_takes_no_place_of_another(place: Objects, database: Database, name: str) -> None:
    place.begin("jobs/ab")
    place.put(name, b"{}")
    with pytest.raises(StoreTakenError, match="another database"):
        ownership.check(database, place)


def test_a_database_that_has_pictures_takes_the_place_to_which_they_were_copied(
    place: Objects, database: Database
) -> None:
    with database.writing() as session:
        session.add(
            RenderRow(
                id="ab",
                state=JobState.SUCCEEDED,
                width=1,
                height=1,
                spec_sha256="",
                passes=[],
                display={},
                total_steps=0,
                total_work=1,
                predicted_cpu_seconds=1.0,
                numerics={},
                pass_costs=[],
            )
        )
    with pytest.raises(StoreTakenError, match="folders jobs and"):
        ownership.check(database, place)
    place.begin("jobs/ab")
    place.put("jobs/ab/image.npy", b"")
    ownership.check(database, place)
    assert place.find(ownership.MARK)


@BOTH
def test_a_place_that_was_claimed_before_a_crash_is_taken_at_the_next_start(
    place: Objects, database: Database
) -> None:
    with database.writing() as session:
        session.scalars(select(LeaderRow)).one().folder = f"{ownership.CLAIMED}ab"
    for _ in range(2):
        ownership.check(database, place)
    assert place.get(ownership.MARK) == b"ab\n"
    with database.reading() as session:
        assert session.scalars(select(LeaderRow)).one().folder == "ab"


@pytest.mark.parametrize("database", ["postgresql"], indirect=True)
def test_of_servers_that_start_at_the_same_moment_those_with_another_place_are_refused(
    place: Objects, database: Database
) -> None:
    parts = [place.within(name) for name in "ababab"]
    for part in parts:
        part.begin("")
    with ThreadPoolExecutor(len(parts)) as pool:
        checks = [pool.submit(ownership.check, database, part) for part in parts]
        refused = [type(check.exception()) for check in checks]
    assert {frozenset(refused[::2]), frozenset(refused[1::2])} == {
        frozenset({type(None)}),
        frozenset({StoreTakenError}),
    }


def test_a_bucket_that_is_not_there_is_reported(object_store: S3Server) -> None:
    with pytest.raises(StoreAwayError, match="AWS_ENDPOINT_URL"):
        place_of("s3://penumbra-nowhere").check()
    with pytest.raises(StoreAwayError):
        place_of("s3://penumbra-nowhere").put("a", b"")
