"""A service with a bucket answers like one with a folder.

Its workers are those of a Dask cluster, each of which has a slot as without one.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterator
from typing import Any

import httpx2
import numpy as np
import pytest
from PIL import Image

import renderer
from schemas.quality import TargetQuality
from service.client.batches import decode_batch
from service.server import RunningServer, running
from service.storage.folder import place_of
from service.storage.ownership import MARK
from service.storage.tiles import TileStore
from tests.s3_server import BUCKET, S3Server
from tests.service.conftest import typical
from tests.service.support import TIMEOUT, finish, image, scene, submit, until, wait

STORE = f"s3://{BUCKET}/service"
TAGS = ("Content-Type", "Content-Length", "Content-Range", "Accept-Ranges", "ETag", "X-Progress")
LONG = scene(128, 128, samples=16, light_samples=36)
"""Dozens of steps: there is time to look, and to disturb it."""
RANGES = ["bytes=0-9", "bytes=20-", "bytes=-7", "bytes=0-99999999", "bytes=0-9,5-19"]


@pytest.fixture(scope="module")
def in_bucket(object_store: S3Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    changes = {"store": STORE, "engine": "dask", "workers": 1}
    with running(typical(tmp_path_factory.mktemp("bucket"), **changes)) as started:
        yield started


@pytest.fixture(scope="module")
def away(in_bucket: RunningServer) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=in_bucket.url, timeout=TIMEOUT) as opened:
        yield opened


@pytest.fixture
def near(client: httpx2.Client) -> httpx2.Client:
    """Who asks a service with a folder."""
    return client


@pytest.fixture(scope="module")
def undisturbed() -> np.ndarray:
    return renderer.render(renderer.compile_scene(LONG), workers=2).image


def objects(job: str = "") -> set[str]:
    return {found.name for found in place_of(STORE).within("jobs").found(job)}


def png() -> bytes:
    file = io.BytesIO()
    Image.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(file, "PNG")
    return file.getvalue()


def textured(data: bytes) -> dict[str, Any]:
    document = scene()
    document["textures"] = {"a": {"type": "image", "asset": f"sha256:{hashlib.sha256(data).hexdigest()}"}}
    document["materials"]["floor"] = {"type": "phong", "color_texture": "a", "ambient": 0.2, "diffuse": 1.0}
    return document


@pytest.mark.parametrize("name", ["image.npy", "image.png", "image.png?width=96", "layers/depth.npy"])
def test_a_picture_has_the_same_bytes_and_answers(
    away: httpx2.Client, near: httpx2.Client, name: str, rendered: dict[str, str]
) -> None:
    here, there = (client.get(f"/v1/jobs/{rendered[key]}/{name}") for key, client in _both(away, near))
    assert here.content == there.content
    assert [here.headers.get(tag) for tag in TAGS] == [there.headers.get(tag) for tag in TAGS]
    known = away.get(f"/v1/jobs/{rendered['away']}/{name}", headers={"If-None-Match": here.headers["ETag"]})
    assert (known.status_code, known.content) == (304, b"")


def _both(away: httpx2.Client, near: httpx2.Client) -> tuple[tuple[str, httpx2.Client], ...]:
    return ("away", away), ("near", near)


@pytest.fixture(scope="module")
def rendered(in_bucket: RunningServer, server: RunningServer) -> dict[str, str]:
    """The same job of the service with a bucket, and of the one with a folder."""
    jobs = {}
    for name, url in (("away", in_bucket.url), ("near", server.url)):
        with httpx2.Client(base_url=url, timeout=TIMEOUT) as client:
            jobs[name] = submit(client, scene(), layers=["depth"])
            finish(client, jobs[name])
    return jobs


@pytest.mark.parametrize("method", ["GET", "HEAD"])
@pytest.mark.parametrize("asked", [*RANGES, "bytes=5-2", "bytes=99999999-", "bytes=x"])
def test_a_part_of_a_picture_is_the_same(
    away: httpx2.Client, near: httpx2.Client, rendered: dict[str, str], asked: str, method: str
) -> None:
    here, there = (
        client.request(method, f"/v1/jobs/{rendered[key]}/image.npy", headers={"Range": asked})
        for key, client in _both(away, near)
    )
    assert (here.status_code, here.content) == (there.status_code, there.content)
    assert [here.headers.get(tag) for tag in TAGS] == [there.headers.get(tag) for tag in TAGS]


@pytest.mark.parametrize("tag", ["ETag", "Last-Modified", None])
def test_a_part_of_another_picture_is_not_given(
    away: httpx2.Client, rendered: dict[str, str], tag: str | None
) -> None:
    path = f"/v1/jobs/{rendered['away']}/image.npy"
    held = away.head(path).headers[tag] if tag else '"other"'
    answer = away.get(path, headers={"Range": "bytes=0-9", "If-Range": held})
    assert answer.status_code == (206 if tag else 200)


def test_pixels_are_in_the_bucket_alone_and_tiles_go(
    away: httpx2.Client, in_bucket: RunningServer, rendered: dict[str, str]
) -> None:
    job = rendered["away"]
    assert place_of(STORE).find(MARK)
    until(lambda: not any("/tiles/" in name for name in objects(job)))
    assert {f"{job}/1-image.npy", f"{job}/spec.json", f"{job}/1-layer-depth.npy"} <= objects(job)
    assert not [path for path in in_bucket.data.rglob("*") if path.suffix in {".npy", ".json"}]


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
    assert canvas.tobytes() == image(away, job).tobytes()
    assert canvas.tobytes() == undisturbed.tobytes()


def test_a_picture_of_target_quality_has_the_bytes_that_the_renderer_makes(away: httpx2.Client) -> None:
    job = submit(away, scene(), quality={"mode": "target", "error": 0.004})
    finish(away, job)
    plan = renderer.compile_scene(scene(), TargetQuality(mode="target", error=0.004))
    assert image(away, job).tobytes() == renderer.render(plan, tile_size=32).image.tobytes()


def test_a_texture_is_sent_rendered_and_fetched(away: httpx2.Client) -> None:
    data = png()
    path = f"/v1/assets/{hashlib.sha256(data).hexdigest()}"
    assert away.put(path, content=data).status_code == 200
    assert away.get(path).content == data
    assert away.get(path, headers={"Range": "bytes=2-5"}).content == data[2:6]
    job = submit(away, textured(data))
    finish(away, job)
    compared = away.post("/v1/comparisons", json={"image": {"job": job}, "reference": {"job": job}})
    assert compared.json()["verdict"] == "match", compared.text


def test_a_large_picture_comes_back_whole_and_in_part(away: httpx2.Client) -> None:
    """Nine megabytes are fetched from the bucket in several pieces."""
    job = submit(away, scene(16, 16, samples=1), layers=["depth"])
    finish(away, job)
    data = np.random.default_rng(1).bytes(9_000_000)
    TileStore(place_of(STORE).within("jobs")).put_final(job, 1, "layer-depth.npy", data)
    path = f"/v1/jobs/{job}/layers/depth.npy"
    assert away.get(path).content == data
    for begin, end in ((0, 8 << 20), (3, 8_999_998), (4 << 20, (4 << 20) + 1)):
        answer = away.get(path, headers={"Range": f"bytes={begin}-{end - 1}"})
        assert (answer.status_code, answer.content == data[begin:end]) == (206, True)


def test_what_is_not_kept_leaves_the_bucket(away: httpx2.Client) -> None:
    job, other = (submit(away, scene(32, 32, samples=1)) for _ in range(2))
    for one in (job, other):
        finish(away, one)
    assert away.delete(f"/v1/jobs/{job}").status_code == 204
    until(lambda: not objects(job))
    assert f"{other}/1-image.npy" in objects(other)


@pytest.mark.slow
def test_jobs_wait_while_the_bucket_is_away(
    away: httpx2.Client, object_store: S3Server, undisturbed: np.ndarray
) -> None:
    done = submit(away, scene(32, 32, samples=1))
    finish(away, done)
    job = submit(away, LONG)
    wait(away, job, lambda found: found["last_seq"] > 0)
    object_store.cut()
    try:
        requests = [("POST", "/v1/jobs"), ("GET", f"/v1/jobs/{done}/image.npy")]
        for method, path in requests:
            body = {"scene": scene(33, 33)} if method == "POST" else None
            answer = away.request(method, path, json=body)
            assert (answer.status_code, answer.json()["code"]) == (503, "store_away"), answer.text
            assert answer.headers["Retry-After"]
        ready = away.get("/readyz")
        assert (ready.status_code, "object store" in ready.json()["detail"]) == (503, True)
        assert away.get(f"/v1/jobs/{job}").json()["state"] == "running"
    finally:
        object_store.begin()
    finish(away, job)
    assert image(away, job).tobytes() == undisturbed.tobytes()
    assert away.get("/readyz").status_code == 200
