"""Tiles, layers and states of jobs, in a folder and in a bucket."""

import hashlib
import itertools
from pathlib import Path

import numpy as np
import pytest

from schemas.tiles import Pass, Tile
from service.errors import StoreDamagedError
from service.storage.folder import Folder
from service.storage.objects import Objects
from service.storage.tiles import StoredTile, TileStore
from tests.service.support import until

TILE, PASS = Tile(0, 0, 0, 4, 3), Pass(1, 1, 0, 1)


@pytest.fixture
def store(place: Objects) -> TileStore:
    made = TileStore(place)
    made.put_spec("job", b"{}")
    return made


def names(place: Objects, prefix: str = "") -> set[str]:
    return {found.name for found in place.found(prefix)}


def test_old_attempt_overwrites_nothing(store: TileStore) -> None:
    newest, stale = (np.full((3, 4, 3), value, np.float32) for value in (2, 1))
    part = StoredTile(TILE, PASS, 2, store.put_tile("job", TILE, PASS, 2, newest))
    store.put_tile("job", TILE, PASS, 1, stale)
    np.testing.assert_array_equal(store.get_tile("job", part), newest)
    assert store.get_spec("job", hashlib.sha256(b"{}").hexdigest()) == b"{}"


def test_damaged_tile_is_noticed(store: TileStore, place: Objects) -> None:
    part = StoredTile(TILE, PASS, 1, store.put_tile("job", TILE, PASS, 1, np.ones((3, 4, 3), np.float32)))
    store.put_layers("job", TILE, PASS, 1, {"depth": np.ones((3, 4), np.float32)})
    whole = place.get("job/tiles/1-0.1")
    for name in ("1-0.1", "1-0.1.npz"):
        data = place.get(f"job/tiles/{name}")
        place.put(f"job/tiles/{name}", data[: len(data) // 2])
    with pytest.raises(StoreDamagedError):
        store.get_tile("job", part)
    with pytest.raises(StoreDamagedError):
        next(store.get_layers("job", [part]))
    place.put("job/tiles/1-0.1", bytes([whole[0] ^ 1]) + whole[1:])
    with pytest.raises(StoreDamagedError):
        store.get_tile("job", part)


def test_sweep_leaves_what_jobs_need(store: TileStore, place: Objects) -> None:
    jobs = ("running", "ended", "unknown")
    store.drop_job("job")
    for job in jobs:
        store.put_spec(job, b"{}")
        store.put_tile(job, TILE, PASS, 1, np.ones((3, 4, 3), np.float32))
    until(lambda: store.sizes() == dict.fromkeys(jobs, 2 + 4 * 36))
    store.sweep({"running", "ended"}, {"ended": None}, 3600.0)
    until(lambda: "ended/tiles/1-0.1" not in names(place))
    assert "unknown/spec.json" in names(place)
    store.sweep({"running", "ended"}, {"ended": None}, 0.0)
    until(lambda: names(place) == {"running/spec.json", "running/tiles/1-0.1", "ended/spec.json"})


@pytest.mark.parametrize("prefix", ["2-", "", None], ids=["attempt", "of version 0.1", "no picture"])
def test_final_files_that_no_row_records_are_swept(
    store: TileStore, place: Objects, prefix: str | None
) -> None:
    files = ("image.npy", "image-96.png", "layer-depth.npy")
    for job in ("job", "running"):
        store.put_spec(job, b"{}")
        for attempt in ("", "1-", "2-", "12-"):
            for name in files:
                store.put_file(job, f"{attempt}{name}", b"final")
    before = names(place, "running")
    store.sweep({"running", "job"}, {"job": prefix}, 3600.0)
    left = set() if prefix is None else {f"job/{prefix}{name}" for name in files}
    assert names(place, "job") == {"job/spec.json", *left}
    assert names(place, "running") == before


def test_merged_passes_go_and_their_layers_stay(store: TileStore, place: Objects) -> None:
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


@pytest.mark.slow
def test_changed_byte_changes_no_layer(tmp_path: Path) -> None:
    """Wherever it is in the file, in an array, in its head or in the list of members."""
    store, part = TileStore(Folder(tmp_path)), StoredTile(TILE, PASS, 1, 0)
    store.put_spec("job", b"{}")
    layers = {"depth": np.ones((3, 4), np.float32), "normal": np.full((3, 4, 3), 0.5, np.float32)}
    store.put_layers("job", TILE, PASS, 1, layers)
    file = tmp_path / "job" / "tiles" / "1-0.1.npz"
    whole = file.read_bytes()
    noticed = 0
    for place, bit in itertools.product(range(len(whole)), (1, 128)):
        file.write_bytes(whole[:place] + bytes([whole[place] ^ bit]) + whole[place + 1 :])
        try:
            [found] = store.get_layers("job", [part])
        except StoreDamagedError:
            noticed += 1
            continue
        assert found.keys() == layers.keys(), place
        assert all(found[name].tobytes() == layers[name].tobytes() for name in layers), place
    assert noticed > len(whole)
