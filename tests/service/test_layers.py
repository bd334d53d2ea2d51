"""Layers over HTTP: the arrays that the renderer makes, and the picture with them as EXR."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest

import renderer
from renderer.images.files import decode_exr
from schemas.api.layers import LAYER_NAMES
from schemas.tiles import Pass, Tile
from service.errors import StoreDamagedError
from service.storage.folder import Folder
from service.storage.tiles import StoredTile, TileStore
from tests.service.conftest import Start
from tests.service.support import (
    TIMEOUT,
    ended,
    finish,
    image,
    job_of,
    long_scene,
    scene,
    submit,
    wait,
)

ALL = list(LAYER_NAMES)


def layer(client: httpx2.Client, job: str, name: str) -> np.ndarray:
    answer = client.get(f"/v1/jobs/{job}/layers/{name}.npy")
    assert answer.status_code == 200, answer.text
    return np.load(io.BytesIO(answer.content))


def rendered(document: dict[str, Any]) -> renderer.RenderResult:
    return renderer.render(renderer.compile_scene(document, layers=ALL))


@pytest.fixture
def done(client: httpx2.Client) -> str:
    job = submit(client, scene(), layers=["depth", "shape"])
    finish(client, job)
    return job


def test_every_layer_has_the_bytes_that_the_renderer_makes(client: httpx2.Client) -> None:
    document = scene()
    job = submit(client, document, layers=ALL)
    finish(client, job)
    wanted = rendered(document)
    assert image(client, job).tobytes() == wanted.image.tobytes()
    for name in LAYER_NAMES:
        found = layer(client, job, name)
        assert (found.dtype, found.shape) == (wanted.layers[name].dtype, wanted.layers[name].shape)
        assert found.tobytes() == wanted.layers[name].tobytes(), name


def test_the_exr_file_has_the_picture_and_the_layers_asked_for(client: httpx2.Client, done: str) -> None:
    answer = client.get(f"/v1/jobs/{done}/image.exr")
    assert answer.status_code == 200
    pixels, layers = decode_exr(answer.content)
    assert pixels.tobytes() == image(client, done).tobytes()
    assert list(layers) == ["depth", "shape"]
    for name, found in layers.items():
        assert found.tobytes() == layer(client, done, name).tobytes()


def test_layers_are_named_by_the_links_of_their_job(client: httpx2.Client, done: str) -> None:
    links = job_of(client, done)["links"]
    assert list(links["layers"]) == ["depth", "shape"]
    for path in (links["image_exr"], *links["layers"].values()):
        assert client.get(path).status_code == 200


@pytest.mark.parametrize("name", ["uv", "dept", "..%2Fimage"])
def test_a_layer_that_was_not_asked_for_is_not_there(client: httpx2.Client, done: str, name: str) -> None:
    answer = client.get(f"/v1/jobs/{done}/layers/{name}.npy")
    assert answer.status_code == 404
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert "uv" not in answer.text


def test_without_layers_a_job_has_none(client: httpx2.Client) -> None:
    job = submit(client, scene())
    found = finish(client, job)
    assert found["links"]["layers"] == {}
    assert "layers" not in found["cost"]["rays"]
    assert client.get(f"/v1/jobs/{job}/layers/depth.npy").json()["code"] == "unknown_layer"


@pytest.mark.parametrize("file", ["layers/depth.npy", "image.exr"])
def test_a_final_file_is_cached_and_sent_in_parts(client: httpx2.Client, done: str, file: str) -> None:
    path = f"/v1/jobs/{done}/{file}"
    whole = client.get(path)
    assert whole.headers["X-Progress"] == "1.0000"
    assert client.get(path, headers={"If-None-Match": whole.headers["ETag"]}).status_code == 304
    part = client.get(path, headers={"Range": "bytes=5-24"})
    assert (part.status_code, part.content) == (206, whole.content[5:25])
    assert client.get(path, headers={"Range": "bytes=99999999-"}).status_code == 416
    head = client.head(path)
    assert (head.content, head.headers["ETag"]) == (b"", whole.headers["ETag"])


def test_a_wrong_name_is_refused_with_the_one_that_was_meant(client: httpx2.Client) -> None:
    answer = client.post("/v1/jobs", json={"scene": scene(), "layers": ["depth", "nromal"]})
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert (error["pointer"], error["suggestion"]) == ("/layers/1", "normal")


@pytest.mark.parametrize("layers", ["depth", [3], {"depth": True}, [None]])
def test_layers_are_an_array_of_names(client: httpx2.Client, layers: Any) -> None:
    answer = client.post("/v1/jobs", json={"scene": scene(), "layers": layers})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["pointer"].startswith("/layers")


def test_the_plan_of_a_request_names_its_layers(client: httpx2.Client) -> None:
    plan = client.post("/v1/plans", json={"scene": scene(), "layers": ["uv"]}).json()
    assert {"layers", "layers.uv"} <= {stage["effect"] for stage in plan["stages"]}


def test_layers_are_there_while_the_picture_is_being_rendered(client: httpx2.Client) -> None:
    document = long_scene()
    job = submit(client, document, layers=["depth", "error"])
    path = f"/v1/jobs/{job}/layers/depth.npy"

    def something_is_seen(_: dict[str, Any]) -> bool:
        found = client.get(path)
        return found.status_code == 200 and bool(np.isfinite(np.load(io.BytesIO(found.content))).any())

    wait(client, job, something_is_seen)
    answer = client.get(path)
    partial = np.load(io.BytesIO(answer.content))
    errors = client.get(f"/v1/jobs/{job}/layers/error.npy")
    running = not ended(job_of(client, job))
    exr = client.get(f"/v1/jobs/{job}/image.exr")
    client.delete(f"/v1/jobs/{job}")
    assert running
    whole = renderer.render(renderer.compile_scene(document | {"sampling": {}}, layers=["depth"])).layers
    there = np.isfinite(partial)
    assert there.any()
    assert np.array_equal(partial[there], whole["depth"][there])
    assert float(answer.headers["X-Progress"]) > 0
    assert 0 < float(errors.headers["X-Progress"]) < 1
    assert not np.isnan(np.load(io.BytesIO(errors.content))).any()
    assert list(decode_exr(exr.content)[1]) == ["depth", "error"]


@pytest.mark.slow
@pytest.mark.parametrize(("tile_size", "workers"), [(16, 2), (64, 1)])
def test_layers_do_not_depend_on_tiles_and_workers(start: Start, tile_size: int, workers: int) -> None:
    document = scene(150, 90)
    server = start(tile_size=tile_size, workers=workers)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        job = submit(client, document, layers=ALL)
        finish(client, job)
        wanted = rendered(document).layers
        for name in LAYER_NAMES:
            assert layer(client, job, name).tobytes() == wanted[name].tobytes(), name


@pytest.mark.slow
def test_layers_outlast_a_killed_server(start: Start) -> None:
    """Tiles recorded before the end are not rendered again, and are not missing."""
    document = long_scene()
    first = start(tile_size=64)
    with httpx2.Client(base_url=first.url, timeout=TIMEOUT) as client:
        job = submit(client, document, layers=["position", "primitive"])
        wait(client, job, lambda found: found["progress"]["done"] >= 6)
    first.process.kill()
    first.process.wait()
    with httpx2.Client(base_url=start(tile_size=64).url, timeout=TIMEOUT) as client:
        finish(client, job)
        whole = renderer.render(renderer.compile_scene(document | {"sampling": {}}, layers=ALL)).layers
        for name in ("position", "primitive"):
            assert layer(client, job, name).tobytes() == whole[name].tobytes()


@pytest.mark.parametrize("harm", ["bit", "end"])
def test_damaged_layers_of_a_tile_are_noticed(tmp_path: Path, harm: str) -> None:
    store, tile, pass_ = TileStore(Folder(tmp_path)), Tile(0, 0, 0, 4, 3), Pass(1, 1, 0, 1)
    store.put_spec("job", b"{}")
    store.put_layers("job", tile, pass_, 1, {"depth": np.ones((3, 4), np.float32)})
    stored = StoredTile(tile, pass_, 1, 0)
    assert np.all(next(store.get_layers("job", [stored]))["depth"] == 1)
    (file,) = (tmp_path / "job" / "tiles").iterdir()
    data = bytearray(file.read_bytes())
    place = data.index(np.float32(1).tobytes())
    file.write_bytes(data[:place] if harm == "end" else data[:place] + b"\x01" + data[place + 1 :])
    with pytest.raises(StoreDamagedError):
        next(store.get_layers("job", [stored]))
