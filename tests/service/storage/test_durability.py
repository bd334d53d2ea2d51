"""Files are on the disk before a row refers to them."""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path

import httpx2
import pytest
from sqlalchemy import func, select

from service.storage.database.models import AssetRow, Base, JobRow
from service.storage.folder import Folder
from service.storage.tiles import TileStore
from tests.service.in_process import InProcess
from tests.service.support import API_ON_BOTH, finish, scene, submit

MESH = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


Synced = list[tuple[Path, int]]
Count = Callable[[], int]


def watch(patch: pytest.MonkeyPatch, count: Count = lambda: 0) -> Synced:
    """Note what is written to the disk by its path then, and how many rows there are."""
    synced: Synced = []
    sync = os.fsync

    def noted(descriptor: int) -> None:
        synced.append((Path(f"/proc/self/fd/{descriptor}").readlink(), count()))
        sync(descriptor)

    patch.setattr(os, "fsync", noted)
    return synced


def test_file_is_on_the_disk_with_its_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    jobs = tmp_path / "data" / "jobs"
    synced, store = watch(monkeypatch), TileStore(Folder(jobs))
    store.put_spec("job", b"{}")
    store.put_final("job", 1, "image.npy", b"pixels")
    paths = [path for path, _ in synced]
    files = [path for path in paths if path.suffix == ".tmp"]
    # Under its temporary name, so that there is never another file under the final one.
    assert [path.parent for path in files] == [jobs / "job"] * 2
    assert {jobs, tmp_path / "data"} <= {*paths}
    assert [path for path in paths if path in (*files, jobs / "job")][-4:] == [
        files[0],
        jobs / "job",
        files[1],
        jobs / "job",
    ]


@API_ON_BOTH
def test_row_follows_its_file(
    request: pytest.FixtureRequest, api: httpx2.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    kind = request.node.callspec.params["api"]
    made: InProcess = request.getfixturevalue("local" if kind == "sqlite" else "local_on_postgres")

    def count(table: type[Base]) -> int:
        with made.service.database.reading() as session:
            return session.scalars(select(func.count()).select_from(table)).one()

    content = MESH + f"# {kind}".encode()
    sha256 = hashlib.sha256(content).hexdigest()
    before = count(AssetRow)
    with monkeypatch.context() as patch:
        synced = watch(patch, lambda: count(AssetRow))
        api.put(f"/v1/assets/{sha256}", content=content).raise_for_status()
    assert [rows for path, rows in synced if path.suffix == ".tmp"] == [before]
    assert count(AssetRow) == before + 1
    before = count(JobRow)
    with monkeypatch.context() as patch:
        synced = watch(patch, lambda: count(JobRow))
        finish(api, submit(api, scene(32, 24, samples=1)))
    # Workers write the picture.
    assert [rows for path, rows in synced if path.suffix == ".tmp"] == [before]
