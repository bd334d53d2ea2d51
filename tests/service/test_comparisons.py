"""Comparisons over HTTP."""

from __future__ import annotations

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
from tests.service.support import TIMEOUT, finish, image, scene, submit
from tests.service.test_bad_requests import problem_of


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


def ask(client: httpx2.Client, one: Any, other: Any, **options: Any) -> httpx2.Response:
    return client.post("/v1/comparisons", json={"image": one, "reference": other} | options)


def test_pictures_that_are_sent_are_compared(client: httpx2.Client) -> None:
    answer = ask(client, sent(npy(gradient()[::-1])), sent(npy(gradient())))
    assert answer.status_code == 200, answer.text
    reported = ComparisonAnswer.model_validate(answer.json())
    assert answer.json()["schema"] == "penumbra/comparison/v1"
    assert reported.verdict == "mismatch"
    assert reported.diagnosis[0].cause == "flipped_vertically"
    assert (reported.inputs.image.width, reported.inputs.image.encoding) == (32, "linear")
    assert reported.images is None


@pytest.mark.parametrize("change", [0.0, 0.004, 0.1])
def test_the_service_says_of_two_pictures_what_the_library_says(client: httpx2.Client, change: float) -> None:
    noise = np.random.default_rng(1).normal(0, change, gradient().shape).astype(np.float32)
    files = npy(gradient() + noise), npy(gradient())
    answer = ask(client, *(sent(content) for content in files)).json()
    pictures = (
        picture_of(content, name) for content, name in zip(files, ("image", "reference"), strict=True)
    )
    local = compare(*pictures).document()
    assert {name: answer[name] for name in local} == json.loads(json.dumps(local))


def test_a_heat_map_is_drawn_where_it_is_asked_for(client: httpx2.Client) -> None:
    picture = sent(npy(gradient()))
    reported = ComparisonAnswer.model_validate(ask(client, picture, picture, pictures=True).json())
    assert reported.verdict == "match"
    assert reported.images is not None
    with Image.open(io.BytesIO(base64.b64decode(reported.images.side_by_side))) as drawn:
        assert drawn.size == (3 * 32 + 8, 24)


def test_a_job_is_compared_with_another_and_places_are_named_by_its_shapes(client: httpx2.Client) -> None:
    document = scene(samples=16, pattern="random", light_pattern="random")
    layers = ["error", "samples"]
    whole = submit(client, document, layers=layers)
    other = submit(client, document | {"sampling": document["sampling"] | {"seed": 8}}, layers=layers)
    bare = submit(client, document | {"shapes": document["shapes"][:1]}, layers=layers)
    for job in (whole, other, bare):
        finish(client, job)
    same = ComparisonAnswer.model_validate(ask(client, {"job": other}, {"job": whole}).json())
    assert (same.verdict, same.test) == ("noisy_match", "variances")
    assert same.inputs.image.samples == 16
    differs = ComparisonAnswer.model_validate(ask(client, {"job": bare}, {"job": whole}).json())
    assert differs.verdict == "mismatch"
    assert differs.worst_regions[0].name == "ellipsoid (shapes/1)"


def test_the_client_compares_files_and_jobs(
    client: httpx2.Client, server: RunningServer, tmp_path: Path
) -> None:
    job = submit(client, scene())
    finish(client, job)
    path = tmp_path / "picture.npy"
    path.write_bytes(npy(image(client, job)))
    with Client(server.url, timeout=TIMEOUT) as penumbra:
        reported = penumbra.compare(path, f"job:{job}")
        stated = penumbra.compare(path.read_bytes(), path, encoding="linear", tolerance=0.5)
    assert reported.verdict == stated.verdict == "match"
    assert stated.inputs.image.encoding_stated
    assert stated.policy.tolerance == 0.5


GOOD = sent(npy(gradient()))


@pytest.mark.parametrize(
    ("changes", "pointer", "word"),
    [
        ({"image": {}}, "/image", "one_of"),
        ({"image": GOOD | {"job": "abc"}}, "/image", "one_of"),
        ({"image": {"job": "abc"}}, "/image/job", "no job"),
        ({"reference": {"content": "%%%"}}, "/reference/content", "Base64"),
        ({"reference": sent(b"GIF89a")}, "/reference", "PNG, NPY or EXR"),
        ({"image": sent(npy(np.full((2, 2, 3), np.nan)))}, "/image", "NaN"),
        ({"image": sent(npy(np.zeros((2, 2, 3), np.uint8)))}, "/image", "State the encoding"),
        ({"image": sent(npy(np.zeros((2, 2, 3))))}, "", "32 x 24"),
        ({"image": GOOD | {"encoding": "gamma"}}, "/image/encoding", "srgb"),
        ({"tolerance": 2}, "/tolerance", "1"),
        ({"tolerence": 0.1}, "/tolerence", "tolerance"),
    ],
)
def test_what_cannot_be_compared_is_pointed_at(
    client: httpx2.Client, changes: dict[str, Any], pointer: str, word: str
) -> None:
    answer = client.post("/v1/comparisons", json={"image": GOOD, "reference": GOOD} | changes)
    found = problem_of(answer, 422)["errors"][0]
    assert found["pointer"] == pointer
    assert word in f"{found['code']} {found['detail']} {found.get('suggestion')}"


def test_a_job_that_is_not_finished_is_not_compared(start: Start) -> None:
    server = start(workers=1)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        job = submit(client, scene(256, 256, samples=400, light_samples=64))
        found = problem_of(ask(client, {"job": job}, GOOD), 422)["errors"][0]
        client.post(f"/v1/jobs/{job}/cancel")
    assert found["pointer"] == "/image/job"
    assert "no complete picture" in found["detail"]


def test_the_command_line_takes_jobs_with_their_layers(client: httpx2.Client, server: RunningServer) -> None:
    job = submit(client, scene(samples=4), layers=["samples", "depth"])
    finish(client, job)
    picture = read(f"job:{job}", None, server.url)
    assert picture.linear.tolist() == np.clip(image(client, job), 0, 1).tolist()
    assert set(picture.layers) == {"samples"}
    with pytest.raises(NotFoundError):
        read("job:none", None, server.url)
