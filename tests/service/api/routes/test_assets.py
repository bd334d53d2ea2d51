"""Textures and meshes: uploaded by content, checked by their headers, decoded by workers alone."""

from typing import Any

import httpx2
import numpy as np
import pytest

import renderer
from schemas.limits import Limits
from service.client import Client, JobFailedError
from service.storage.assets import AssetStore
from service.storage.folder import Folder
from tests.renderer.picture_files import exr
from tests.service.conftest import Start
from tests.service.in_process import InProcess
from tests.service.sending import (
    DAMAGED,
    hollow_png,
    mistakes,
    name_of,
    ply,
    png,
    problem_of,
    put,
    textured,
    with_mesh,
)
from tests.service.support import TIMEOUT, ended, finish, image, scene, submit, wait

LIGHT = np.random.default_rng(3).random((7, 5), np.float32) * 2
OBJ = b"v 1 2 1\nv 1 0 -1\nv -1 2 -1\nv -1 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n"


def kept(local: InProcess) -> set[str]:
    return {path.name for path in (local.service.settings.data / "assets").iterdir()}


def test_asset_comes_back_as_it_was_sent(api: httpx2.Client) -> None:
    data = png(5, 7)
    expected = {"name": name_of(data), "bytes": len(data), "media_type": "image/png", "width": 5, "height": 7}
    assert [put(api, data).json() for _ in range(2)] == [expected] * 2
    path = f"/v1/assets/{name_of(data).removeprefix('sha256:')}"
    got = api.get(path)
    assert (got.content, got.headers["Content-Type"]) == (data, "image/png")
    assert got.headers["Content-Disposition"] == "attachment"
    assert api.head(path).status_code == 200
    assert api.get(path, headers={"If-None-Match": got.headers["ETag"]}).status_code == 304
    assert api.get(path, headers={"Range": "bytes=1-3"}).content == b"PNG"


def test_condition_decides_whether_a_file_is_received(api: httpx2.Client) -> None:
    data = png(3, 11)
    path = f"/v1/assets/{name_of(data).removeprefix('sha256:')}"
    for headers, status in (
        ({"If-Match": "*"}, 412),
        ({"If-None-Match": "*"}, 200),
        ({"If-None-Match": "*"}, 412),
        ({"If-Match": "*"}, 200),
        ({}, 200),
    ):
        assert api.put(path, content=data, headers=headers).status_code == status, headers


@pytest.mark.parametrize(
    "data", [png(), exr(dict.fromkeys("RGB", LIGHT)), OBJ, ply()], ids=["png", "exr", "obj", "ply"]
)
def test_scene_is_rendered_with_an_uploaded_file(api: httpx2.Client, local: InProcess, data: bytes) -> None:
    sent = put(api, data).json()
    document = textured(sent["name"]) if sent["width"] else with_mesh(data)
    for texture in document.get("textures", {}).values():
        texture["encoding"] = "linear"
    job = submit(api, document)
    finish(api, job)
    assets = AssetStore(Folder(local.service.settings.data / "assets"), Limits())
    plan = renderer.compile_scene(renderer.load_scene(document, assets=assets))
    assert image(api, job).tobytes() == renderer.render(plan, workers=1).image.tobytes()


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", ""),
        (b"hello", ""),
        (b"\x89PNG\r\n\x1a\n", ""),
        (b"<svg/>", ""),
        (exr({"Z": LIGHT}), "channels"),
        (b"#?RADIANCE\n\n-Y 7", "damaged"),
        (hollow_png(2000, 2000), "pixels"),
        (ply(announced=10**9), "triangles"),
    ],
    ids=["nothing", "text", "half a PNG", "SVG", "no colours", "cut off", "pixels", "triangles"],
)
def test_file_that_cannot_be_used_is_not_kept(
    api: httpx2.Client, local: InProcess, data: bytes, said: str
) -> None:
    before = kept(local)
    found = problem_of(put(api, data), 422)
    assert (found["code"], said in found["detail"]) == ("upload_unusable", True)
    assert kept(local) == before


def test_file_that_is_too_long_or_misnamed_is_not_kept(api: httpx2.Client, local: InProcess) -> None:
    before = kept(local)
    problem_of(put(api, bytes(200_001)), 413)
    problem_of(api.put(f"/v1/assets/{'0' * 64}", content=iter([bytes(100_000)] * 3)), 413)
    assert problem_of(put(api, png(), "ab" * 32), 422)["code"] == "upload_mismatch"
    problem_of(api.get(f"/v1/assets/{'ab' * 32}"), 404)
    for name in ("abc", "AB" * 32, "..%2F" * 12 + "abcd", "g" * 64):
        assert api.get(f"/v1/assets/{name}").status_code in {404, 422}
        assert api.put(f"/v1/assets/{name}", content=b"x").status_code in {404, 405, 422}
    assert kept(local) == before


@pytest.mark.parametrize(
    ("asset", "code"),
    [("sha256:" + "0" * 64, "unknown_asset"), ("wood.png", "asset_name"), ("/etc/passwd", "asset_name")],
)
def test_file_that_was_not_uploaded_is_pointed_at(api: httpx2.Client, asset: str, code: str) -> None:
    document = textured(asset)
    document["shapes"][1] = {"type": "mesh", "asset": asset, "material": "ball"}
    for path in ("/v1/jobs", "/v1/plans"):
        assert mistakes(api.post(path, json={"scene": document})) == [
            ("/scene/textures/a~1b/asset", code),
            ("/scene/shapes/1/asset", code),
        ]


@pytest.mark.parametrize(
    ("data", "document", "place"),
    [
        (hollow_png(40, 40), textured(name_of(hollow_png(40, 40))), "/scene/textures/a~1b/asset: "),
        (DAMAGED, with_mesh(DAMAGED), "/scene/shapes/1/asset: "),
    ],
    ids=["picture", "mesh"],
)
def test_damaged_file_fails_its_job_and_is_named(
    api: httpx2.Client, data: bytes, document: dict[str, Any], place: str
) -> None:
    assert put(api, data).status_code == 200
    failure = wait(api, submit(api, document), ended)["failure"]
    assert failure["code"] == "scene_not_usable"
    assert failure["message"].startswith(place)


@pytest.mark.slow
def test_worker_keeps_to_the_limits_of_its_service(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    """They come from the settings, which a file may hold that no worker sees."""
    monkeypatch.setenv("PENUMBRA_LIMITS__MAX_MESH_TRIANGLES", "1000")
    three = {"type": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "triangles": [[0, 1, 2]] * 3}
    document = scene() | {"shapes": [three | {"material": "ball"}]}
    with Client(start(limits=Limits(max_mesh_triangles=2), workers=1).url) as client:
        job = client.submit(document)
        with pytest.raises(JobFailedError, match="3 triangles together"):
            job.wait(timeout=TIMEOUT)
    assert job.failure is not None
    assert job.failure.code == "scene_not_usable"
