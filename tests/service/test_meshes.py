"""Mesh files: uploaded by content, parsed in a worker, never where requests are answered."""

from __future__ import annotations

import base64
import hashlib
import json
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest

import renderer
from schemas.limits import Limits
from service.client import Client, JobFailedError
from service.storage.assets import AssetStore
from service.storage.folder import Folder
from tests.pictures.test_gltf_files import placed, with_buffers, written
from tests.pictures.test_mesh_files import FILES, HUGE, solid
from tests.service.conftest import Start
from tests.service.support import TIMEOUT, ended, finish, image, scene, submit, wait
from tests.service.test_assets import png, put
from tests.service.test_bad_requests import problem_of


def with_mesh(content: bytes) -> dict[str, Any]:
    document = scene()
    asset = "sha256:" + hashlib.sha256(content).hexdigest()
    document["shapes"][1] = {"type": "mesh", "asset": asset, "smooth": True, "material": "ball"}
    return document


@pytest.mark.parametrize("kind", ["obj", "ply binary", "glb"])
def test_a_scene_is_rendered_with_an_uploaded_mesh(client: httpx2.Client, server: Any, kind: str) -> None:
    content = FILES[kind]()
    sent = put(client, content)
    assert sent.status_code == 200
    assert (sent.json()["width"], sent.json()["height"]) == (0, 0)
    job = submit(client, with_mesh(content))
    finish(client, job)
    assets = AssetStore(Folder(server.data / "assets"), Limits(max_image_pixels=1))
    expected = renderer.render(renderer.compile_scene(renderer.load_scene(with_mesh(content), assets=assets)))
    np.testing.assert_array_equal(image(client, job), expected.image)


@pytest.mark.parametrize("path", ["/v1/jobs", "/v1/plans"])
def test_a_mesh_is_accepted_beside_a_small_displaced_shape(client: httpx2.Client, path: str) -> None:
    mesh, heights = FILES["obj"](), png()
    texture = {"type": "image", "asset": put(client, heights).json()["name"], "encoding": "linear"}
    assert put(client, mesh).status_code == 200
    document = with_mesh(mesh)
    relief = {**document["materials"]["ball"], "displacement_map": "heights", "displacement_height": 0.001}
    document["textures"] = {"heights": texture}
    document["materials"]["relief"] = relief
    small = {"type": "rectangle", "corner": [0, 0, 0], "edges": [[0.01, 0, 0], [0, 0.01, 0]]}
    document["shapes"].append({**small, "material": "relief"})
    assert client.post(path, json={"scene": document}).is_success


def test_a_file_that_announces_too_many_triangles_is_not_kept(client: httpx2.Client) -> None:
    for content in (HUGE["ply faces"], HUGE["zeros"]):
        assert "Simplify it." in problem_of(put(client, content), 422)["detail"]


def test_a_mesh_that_was_not_uploaded_is_reported_by_its_place(client: httpx2.Client) -> None:
    answer = client.post("/v1/jobs", json={"scene": with_mesh(b"nothing")})
    assert [error["pointer"] for error in problem_of(answer, 422)["errors"]] == ["/scene/shapes/1/asset"]


def test_a_picture_is_no_mesh(client: httpx2.Client) -> None:
    assert put(client, png()).status_code == 200
    answer = client.post("/v1/jobs", json={"scene": with_mesh(png())})
    assert [error["pointer"] for error in problem_of(answer, 422)["errors"]] == ["/scene/shapes/1/asset"]


def test_a_damaged_mesh_fails_its_job_and_is_named(client: httpx2.Client) -> None:
    content = FILES["ply binary"]()[:3000]
    assert put(client, content).status_code == 200
    job = submit(client, with_mesh(content))
    failed = wait(client, job, ended)
    assert failed["state"] == "failed"
    assert failed["failure"]["code"] == "scene_not_usable"
    assert failed["failure"]["message"].startswith("/scene/shapes/1/asset: ")


def test_a_gltf_file_whose_buffers_lie_elsewhere_is_refused_with_what_to_send(client: httpx2.Client) -> None:
    made = placed()
    reported = problem_of(put(client, with_buffers(made, uri="m.bin")), 422)["detail"]
    assert "GLB" in reported
    assert "penumbra submit" in reported
    embedded = "data:;base64," + base64.b64encode(made.binary).decode()
    sent = put(client, with_buffers(made, uri=embedded))
    assert sent.status_code == 200
    assert sent.json()["media_type"] == "model/gltf+json"


def test_a_scene_with_a_gltf_file_is_submitted_with_its_buffers(server: Any, tmp_path: Path) -> None:
    for name, content in written(solid()).items():
        (tmp_path / name).write_bytes(content)
    document = scene() | {"name": "a mesh beside its buffers"}
    document["shapes"][1] = {"type": "mesh", "asset": "model.gltf", "material": "ball"}
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(document))
    with Client(server.url) as client:
        found = client.submit(path).wait().image()
    expected = renderer.render(renderer.compile_scene(renderer.load_scene(path)))
    np.testing.assert_array_equal(found, expected.image)


def test_a_worker_keeps_to_the_limits_of_its_service_and_not_to_those_of_its_machine(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
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
    assert "PENUMBRA_LIMITS__MAX_MESH_TRIANGLES" in job.failure.message
