"""``penumbra doctor --data``: what is damaged is named, in a folder and in a bucket."""

import hashlib
from pathlib import Path

import httpx2
import pytest

from service.settings import Settings
from service.storage.folder import place_of
from service.storage.objects import Objects
from tests.s3_server import BUCKET
from tests.service.cli.conftest import Penumbra
from tests.service.forking import running
from tests.service.support import TIMEOUT, finish, scene, submit

MESH = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
ASSET = hashlib.sha256(MESH).hexdigest()


def changed(place: Objects, name: str) -> None:
    content = place.get(name)
    middle = len(content) // 2
    place.put(name, content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["folder", "bucket"])
def test_damaged_files_are_named(
    here: Penumbra, tmp_path: Path, kind: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = None
    if kind == "bucket":
        request.getfixturevalue("object_store")
        store = f"s3://{BUCKET}/doctor"
    data = tmp_path / "data"
    # A process of its own: workers inherit the address of the bucket.
    settings = Settings(data=data, store=store, port=0, workers=1)
    with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        client.put(f"/v1/assets/{ASSET}", content=MESH).raise_for_status()
        job = submit(client, scene(32, 24, samples=1), layers=["depth"])
        finish(client, job)
        client.get(f"/v1/jobs/{job}/image.png").raise_for_status()
    monkeypatch.setenv("PENUMBRA_DATA", str(data))
    asked = ["doctor", "--data", store or data, "--json"]
    files = [f"{job}/{name}" for name in ("spec.json", "1-image.npy", "1-image.png", "1-layer-depth.npy")]
    names = sorted([f"assets/{ASSET}", *(f"jobs/{file}" for file in files)])
    outcome = here(*asked)
    assert (outcome.code, outcome.document["files"], outcome.document["damaged"]) == (0, len(names), [])
    place = place_of(store or str(data))
    for name in names:
        changed(place, name)
    outcome = here(*asked)
    assert (outcome.code, sorted(outcome.document["damaged"])) == (1, names)
    assert all(name in here(*asked[:-1]).out for name in names)
    place.delete(names)
    # An encoding that is gone is made again.
    assert sorted(here(*asked).document["damaged"]) == [name for name in names if not name.endswith(".png")]


def test_folder_without_a_database_is_refused(here: Penumbra, tmp_path: Path) -> None:
    outcome = here("doctor", "--data", tmp_path)
    assert outcome.code == 2
    assert "no database" in outcome.err
    assert list(tmp_path.iterdir()) == []
