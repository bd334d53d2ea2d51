"""A service with a bucket answers like one with a folder, and waits for its bucket only where it must."""

import hashlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

import httpx2
import numpy as np
import pytest
from sqlalchemy import select

import renderer
from service.client.batches import decode_batch
from service.lifecycle.rows import documents_of
from service.server import RunningServer
from service.settings import Settings
from service.storage.bucket import CALL_SECONDS
from service.storage.database.connection import Database
from service.storage.database.models import RenderRow
from service.storage.folder import place_of
from service.storage.ownership import MARK_FILE
from service.storage.tiles import Checksums, TileStore
from tests.s3_server import BUCKET, S3Server
from tests.service.conftest import Start, typical
from tests.service.forking import running
from tests.service.support import TIMEOUT, finish, image, scene, submit, until, wait

STORE = f"s3://{BUCKET}/service"
TAGS = ("Content-Type", "Content-Length", "Content-Range", "Accept-Ranges", "ETag", "X-Progress")
LONG = scene(128, 128, samples=16, light_samples=36)
RANGES = ["bytes=0-9", "bytes=20-", "bytes=-7", "bytes=0-99999999", "bytes=0-9,5-19"]
REFUSED = ["bytes=5-2", "bytes=99999999-", "bytes=x"]
SMALL = scene(32, 32, samples=1)
MESH = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture(scope="module")
def in_bucket(object_store: S3Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    with running(typical(tmp_path_factory.mktemp("bucket"), store=STORE, workers=1)) as started:
        yield started


@pytest.fixture(scope="module")
def away(in_bucket: RunningServer) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=in_bucket.url, timeout=TIMEOUT) as opened:
        yield opened


@pytest.fixture(scope="module")
def rendered(in_bucket: RunningServer, server: RunningServer) -> dict[str, str]:
    """The same job of the service with a bucket, and of the one with a folder."""
    jobs = {}
    for name, url in (("away", in_bucket.url), ("near", server.url)):
        with httpx2.Client(base_url=url, timeout=TIMEOUT) as client:
            jobs[name] = submit(client, scene(), layers=["depth"])
            finish(client, jobs[name])
    return jobs


@pytest.fixture(scope="module")
def undisturbed() -> np.ndarray:
    return renderer.render(renderer.compile_scene(LONG), workers=2).image


def objects(job: str = "") -> set[str]:
    return {found.name for found in place_of(STORE).within("jobs").found(job)}


def test_picture_has_the_same_bytes_and_answers(
    away: httpx2.Client, client: httpx2.Client, rendered: dict[str, str]
) -> None:
    for name in ("image.npy", "image.png", "image.png?width=96", "layers/depth.npy"):
        here, there = (
            client.get(f"/v1/jobs/{rendered['near']}/{name}"),
            away.get(path := f"/v1/jobs/{rendered['away']}/{name}"),
        )
        assert here.content == there.content
        assert [here.headers.get(tag) for tag in TAGS] == [there.headers.get(tag) for tag in TAGS]
        known = away.get(path, headers={"If-None-Match": here.headers["ETag"]})
        assert (known.status_code, known.content) == (304, b"")


@pytest.mark.parametrize("method", ["GET", "HEAD"])
def test_ranges_are_the_same(
    away: httpx2.Client, client: httpx2.Client, rendered: dict[str, str], method: str
) -> None:
    for asked in (*RANGES, *REFUSED):
        here, there = (
            each.request(method, f"/v1/jobs/{rendered[key]}/image.npy", headers={"Range": asked})
            for key, each in (("near", client), ("away", away))
        )
        assert (here.status_code, here.content) == (there.status_code, there.content), asked
        assert [here.headers.get(tag) for tag in TAGS] == [there.headers.get(tag) for tag in TAGS], asked


def test_pixels_are_in_the_bucket_alone(
    away: httpx2.Client, in_bucket: RunningServer, rendered: dict[str, str]
) -> None:
    job = rendered["away"]
    assert place_of(STORE).find(MARK_FILE)
    until(lambda: not any("/tiles/" in name for name in objects(job)))
    assert {f"{job}/1-image.npy", f"{job}/spec.json", f"{job}/1-layer-depth.npy"} <= objects(job)
    assert not [path for path in in_bucket.data.rglob("*") if path.suffix in {".npy", ".json"}]


@pytest.mark.slow
def test_tiles_are_shown_while_others_are_rendered(away: httpx2.Client, undisturbed: np.ndarray) -> None:
    job = submit(away, LONG)
    wait(away, job, lambda found: found["last_seq"] > 3)
    partial = away.get(f"/v1/jobs/{job}/image.png")
    assert 0 < float(partial.headers["X-Progress"]) < 1
    canvas, after, complete = np.zeros((128, 128, 3), np.float32), 0, False
    while not complete:
        answer = away.get(
            f"/v1/jobs/{job}/tiles",
            params={"after": after, "wait": 5},
            headers={"Accept": "application/octet-stream"},
        )
        batch = decode_batch(answer.content)
        for tile in batch.tiles:
            tile.paint(canvas)
        after, complete = batch.next, batch.complete
    assert canvas.tobytes() == image(away, job).tobytes() == undisturbed.tobytes()


def test_asset_is_sent_rendered_and_fetched(away: httpx2.Client) -> None:
    name = hashlib.sha256(MESH).hexdigest()
    assert away.put(f"/v1/assets/{name}", content=MESH).status_code == 200
    assert away.get(f"/v1/assets/{name}").content == MESH
    assert away.get(f"/v1/assets/{name}", headers={"Range": "bytes=2-5"}).content == MESH[2:6]
    document = scene()
    document["shapes"].append({"type": "mesh", "asset": f"sha256:{name}", "material": "ball"})
    finish(away, job := submit(away, document))
    compared = away.post("/v1/comparisons", json={"image": {"job": job}, "reference": {"job": job}})
    assert compared.json()["verdict"] == "match", compared.text


def enter(server: RunningServer, job: str, checksums: Checksums) -> None:
    """Enter what was stored in place of files of a job."""
    database = Database(Settings(data=server.data).database_url)
    with database.writing() as session:
        render = session.scalars(select(RenderRow).where(RenderRow.id == job)).one()
        render.checksums = (render.checksums or {}) | documents_of(checksums)
    database.close()


def test_large_picture_comes_back_whole_and_in_part(
    away: httpx2.Client, in_bucket: RunningServer, rendered: dict[str, str]
) -> None:
    """Nine megabytes are fetched from the bucket in several pieces."""
    job = submit(away, SMALL, layers=["depth"])
    finish(away, job)
    data = np.random.default_rng(1).bytes(9_000_000)
    kept = TileStore(place_of(STORE).within("jobs")).put_final(job, 1, "layer-depth.npy", data)
    enter(in_bucket, job, kept)
    path = f"/v1/jobs/{job}/layers/depth.npy"
    assert away.get(path).content == data
    for begin, end in ((0, 8 << 20), (3, 8_999_998), (4 << 20, (4 << 20) + 1)):
        answer = away.get(path, headers={"Range": f"bytes={begin}-{end - 1}"})
        assert (answer.status_code, answer.content == data[begin:end]) == (206, True)
    # What is deleted leaves the bucket, and nothing else does.
    assert away.delete(f"/v1/jobs/{job}").status_code == 204
    until(lambda: not objects(job))
    assert f"{rendered['away']}/1-image.npy" in objects(rendered["away"])


@pytest.mark.slow
@pytest.mark.usefixtures("object_store")
def test_cluster_renders_into_a_bucket(start: Start) -> None:
    server = start(store=f"s3://{BUCKET}/cluster", engine="dask", workers=1)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        job = submit(client, SMALL)
        finish(client, job)
        expected = renderer.render(renderer.compile_scene(SMALL)).image
        assert image(client, job).tobytes() == expected.tobytes()


@pytest.mark.slow
def test_jobs_wait_while_the_bucket_is_away(
    away: httpx2.Client, object_store: S3Server, undisturbed: np.ndarray
) -> None:
    done = submit(away, SMALL)
    finish(away, done)
    job = submit(away, LONG)
    wait(away, job, lambda found: found["last_seq"] > 0)
    object_store.cut()
    try:
        refused = [
            away.post("/v1/jobs", json={"scene": scene(33, 33)}),
            away.get(f"/v1/jobs/{done}/image.npy"),
        ]
        for answer in refused:
            assert (answer.status_code, answer.json()["code"]) == (503, "store_away"), answer.text
            assert answer.headers["Retry-After"]
        assert away.get("/readyz").status_code == 503
        assert away.get(f"/v1/jobs/{job}").json()["state"] == "running"
    finally:
        object_store.begin()
    finish(away, job)
    assert image(away, job).tobytes() == undisturbed.tobytes()
    assert away.get("/readyz").status_code == 200


@pytest.mark.slow
def test_request_without_need_of_the_bucket_does_not_wait(
    away: httpx2.Client, object_store: S3Server
) -> None:
    job = submit(away, SMALL)
    finish(away, job)
    other = scene(33, 33, samples=1)
    object_store.stall()
    try:
        with ThreadPoolExecutor(1) as pool:
            sent = pool.submit(away.post, "/v1/jobs", json={"scene": other})
            pins = []
            while not sent.done():
                pins.append(away.put(f"/v1/jobs/{job}/pin"))
            answer, ready = sent.result(), away.get("/readyz")
    finally:
        object_store.resume()
    assert (answer.status_code, answer.json()["code"]) == (503, "store_away"), answer.text
    assert answer.headers["Retry-After"]
    assert {pin.status_code for pin in pins} == {200}
    # The last of them were sent while the other request waited, and none has waited as it did.
    assert max(pin.elapsed for pin in pins) < timedelta(seconds=CALL_SECONDS / 2)
    assert ready.status_code == 503
    finish(away, submit(away, other))
