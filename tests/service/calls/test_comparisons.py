"""Comparisons over HTTP, by the client and on the command line."""

import base64
import io
import json
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from PIL import Image

from accuracy.comparison import compare, picture_of
from schemas.api.comparisons import ComparisonAnswer
from service.cli.compare import read
from service.client import Client, NotFoundError
from service.server import RunningServer
from tests.service.conftest import Start
from tests.service.sending import mistakes, name_of, problem_of, put, textured
from tests.service.support import TIMEOUT, finish, image, long_scene, scene, submit


def npy(pixels: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.save(file, pixels)
    return file.getvalue()


def sent(content: bytes, **more: str) -> dict[str, str]:
    return {"content": base64.b64encode(content).decode(), **more}


def gradient() -> np.ndarray:
    """24 x 32 pixels without symmetry."""
    pixels = np.linspace(0.1, 0.9, 24 * 32 * 3, dtype=np.float32).reshape(24, 32, 3)
    pixels[:8, :8, 0] = 0.95
    return pixels


GOOD = sent(npy(gradient()))


def ask(client: httpx2.Client, one: Any, other: Any, **options: Any) -> httpx2.Response:
    return client.post("/v1/comparisons", json={"image": one, "reference": other} | options)


def test_pictures_are_compared_as_by_the_library(api: httpx2.Client) -> None:
    files = npy(gradient()[::-1]), npy(gradient())
    answer = ask(api, *map(sent, files), pictures=True)
    assert answer.status_code == 200, answer.text
    reported = ComparisonAnswer.model_validate(answer.json())
    assert (reported.verdict, reported.diagnosis[0].cause) == ("mismatch", "flipped_vertically")
    assert (reported.inputs.image.width, reported.inputs.image.encoding) == (32, "linear")
    assert reported.images is not None
    with Image.open(io.BytesIO(base64.b64decode(reported.images.side_by_side))) as drawn:
        assert drawn.size == (3 * 32 + 8, 24)
    local = compare(picture_of(files[0], "image"), picture_of(files[1], "reference")).document()
    assert {name: answer.json()[name] for name in local} == json.loads(json.dumps(local))


@pytest.mark.slow
def test_jobs_are_compared_with_their_noise_and_their_shapes(api: httpx2.Client) -> None:
    document = scene(samples=16, pattern="random", light_pattern="random")
    layers = ["error", "samples"]
    whole = submit(api, document, layers=layers)
    other = submit(api, document | {"sampling": document["sampling"] | {"seed": 8}}, layers=layers)
    bare = submit(api, document | {"shapes": document["shapes"][:1]}, layers=layers)
    for job in (whole, other, bare):
        finish(api, job)
    same = ComparisonAnswer.model_validate(ask(api, {"job": other}, {"job": whole}).json())
    assert (same.verdict, same.test) == ("noisy_match", "variances")
    assert same.inputs.image.samples == 16
    differs = ComparisonAnswer.model_validate(ask(api, {"job": bare}, {"job": whole}).json())
    assert (differs.verdict, differs.worst_regions[0].name) == ("mismatch", "ellipsoid (shapes/1)")


def test_what_cannot_be_compared_is_pointed_at(api: httpx2.Client) -> None:
    running = submit(api, long_scene())
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"image": {}}, "/image"),
        ({"image": GOOD | {"job": "abc"}}, "/image"),
        ({"image": {"job": "abc"}}, "/image/job"),
        ({"image": {"job": running}}, "/image/job"),
        ({"reference": {"content": "%%%"}}, "/reference/content"),
        ({"reference": sent(b"GIF89a")}, "/reference"),
        ({"image": sent(npy(np.full((2, 2, 3), np.nan)))}, "/image"),
        ({"image": sent(npy(np.zeros((2, 2, 3), np.uint8)))}, "/image"),
        ({"image": sent(npy(np.zeros((2, 2, 3))))}, "/image"),
        ({"image": GOOD | {"encoding": "gamma"}}, "/image/encoding"),
        ({"tolerance": 2}, "/tolerance"),
        ({"tolerence": 0.1}, "/tolerence"),
    ]
    for changes, pointer in wrong:
        answer = api.post("/v1/comparisons", json={"image": GOOD, "reference": GOOD} | changes)
        assert mistakes(answer)[0][0] == pointer
    api.delete(f"/v1/jobs/{running}")


def test_client_and_command_line_compare_files_and_jobs(
    client: httpx2.Client, server: RunningServer, tmp_path: Path
) -> None:
    job = submit(client, scene(), layers=["samples", "depth"])
    finish(client, job)
    path = tmp_path / "picture.npy"
    path.write_bytes(npy(image(client, job)))
    with Client(server.url, timeout=TIMEOUT) as penumbra:
        reported = penumbra.compare(path, f"job:{job}")
        stated = penumbra.compare(path.read_bytes(), path, encoding="linear", tolerance=0.5)
    assert reported.verdict == stated.verdict == "match"
    assert stated.inputs.image.encoding_stated
    assert stated.policy.tolerance == 0.5
    picture = read(f"job:{job}", None, server.url)
    assert picture.linear.tolist() == np.clip(image(client, job), 0, 1).tolist()
    assert set(picture.layers) == {"samples"}
    with pytest.raises(NotFoundError):
        read("job:none", None, server.url)


def test_uploaded_picture_is_compared(api: httpx2.Client) -> None:
    content = npy(gradient())
    for wrong in (npy(gradient()[0]), content[:200], npy(np.array([[[None]]], object))):
        assert problem_of(put(api, wrong), 422)["code"] == "upload_unusable"
    assert put(api, content).json()["width"] == 32
    named = {"asset": name_of(content)}
    uploaded, inline = ask(api, named, named), ask(api, GOOD, GOOD)
    assert (uploaded.status_code, uploaded.json()) == (200, inline.json())
    missing = {"asset": "sha256:" + "0" * 64}
    assert mistakes(ask(api, missing, named)) == [("/image/asset", "unknown_asset")]
    assert mistakes(ask(api, named, named | GOOD)) == [("/reference", "one_of")]
    # It is no texture.
    plan = api.post("/v1/plans", json={"scene": textured(name_of(content))})
    assert mistakes(plan) == [("/scene/textures/a~1b/asset", "asset")]


@pytest.mark.slow
def test_picture_larger_than_a_request_is_compared(start: Start) -> None:
    pixels = np.random.default_rng(1).random((1024, 1024, 3), np.float32)
    with Client(start(workers=1).url) as client:
        assert client.compare(pixels, pixels[:, ::-1]).diagnosis[0].cause == "flipped_horizontally"
