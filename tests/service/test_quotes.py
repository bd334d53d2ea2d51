"""Quotes over HTTP."""

from __future__ import annotations

import hashlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx2
import pytest

import renderer
from accuracy.quotes import SECONDS
from schemas.api.plans import Quote
from schemas.quality import FixedQuality, TargetQuality
from service.client import BusyError, Client, RequestInvalidError
from service.server import RunningServer
from tests.service.conftest import Start
from tests.service.support import TIMEOUT, scene
from tests.service.test_bad_requests import problem_of

SAMPLES = {"mode": "fixed", "antialiasing": {"pattern": "sobol", "samples": 2}}


def ask(client: httpx2.Client, **changes: Any) -> httpx2.Response:
    return client.post("/v1/quotes", json={"scene": scene()} | changes)


def test_a_quote_prices_what_is_asked_for_and_other_qualities(client: httpx2.Client) -> None:
    reported = Quote.model_validate(ask(client, target_error=0.02, seconds=60).json())
    assert reported.workers == 2
    assert reported.asked is not None
    assert isinstance(reported.asked.quality, FixedQuality)
    assert reported.asked.quality.antialiasing == renderer.load_scene(scene()).document.sampling.antialiasing
    assert reported.asked in reported.offers
    assert len(reported.offers) > 5
    assert {each.effect: each.pointers for each in reported.effects}.items() <= {
        "light 0": ("/scene/lights/0",),
        "highlights": ("/scene/materials/ball/specular",),
    }.items()
    assert reported.price == renderer.compile_scene(scene()).describe().cost


def test_a_pilot_takes_no_longer_than_it_may(client: httpx2.Client) -> None:
    # The whole picture would take hours.
    document = scene(1000, 1000, samples=1024, light_samples=1024)
    reported = Quote.model_validate(ask(client, scene=document).json())
    # One unit of work may end late, on a machine with other work.
    assert reported.pilot.seconds < 3 * SECONDS
    assert reported.asked is None or reported.asked.cpu_seconds.estimate > 600


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"target_error": 0}, "/target_error"),
        ({"target_error": "0.1"}, "/target_error"),
        ({"target_error": 1.5}, "/target_error"),
        ({"seconds": 0}, "/seconds"),
        ({"seconds": 1e6}, "/seconds"),
        ({"quality": {"mode": "target", "error": 2}}, "/quality/error"),
        ({"quality": {"mode": "quick"}}, "/quality/mode"),
        ({"layers": ["depth"]}, "/layers"),
        ({"scene": scene() | {"camera": {}}}, "/scene/camera"),
        ({"scene": scene(2000, 2000)}, "/scene/camera"),
    ],
)
def test_what_makes_no_sense_is_pointed_at(
    client: httpx2.Client, changes: dict[str, Any], pointer: str
) -> None:
    found = problem_of(ask(client, **changes), 422)["errors"]
    assert found[0]["pointer"].startswith(pointer)


def test_a_mesh_that_cannot_be_read_is_reported(client: httpx2.Client) -> None:
    content = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"
    name = _uploaded(client, content)
    mesh = {"type": "mesh", "asset": name, "material": "ball"}
    answer = ask(client, scene=scene() | {"shapes": [mesh]})
    assert problem_of(answer, 422)["code"] == "quote_failed"


def _uploaded(client: httpx2.Client, content: bytes) -> str:
    sha256 = hashlib.sha256(content).hexdigest()
    answer = client.put(
        f"/v1/assets/{sha256}", content=content, headers={"Content-Type": "application/octet-stream"}
    )
    name = answer.json()["name"]
    assert isinstance(name, str)
    return name


def test_a_quote_of_target_quality_prices_its_error(client: httpx2.Client) -> None:
    quality = {"mode": "target", "error": 0.03, "time_limit": 20}
    reported = Quote.model_validate(ask(client, quality=quality).json())
    assert reported.asked is not None
    assert reported.asked.quality == TargetQuality(mode="target", error=0.03, time_limit=20)


def test_a_job_is_admitted_at_the_price_that_it_was_quoted(client: httpx2.Client) -> None:
    body = {"scene": scene(64, 64), "quality": SAMPLES}
    reported = Quote.model_validate(client.post("/v1/quotes", json=body).json())
    assert reported.asked is not None
    quoted = reported.asked.cpu_seconds.estimate
    assert client.post("/v1/plans", json=body).json()["cost"]["cpu_seconds"] == quoted
    assert client.post("/v1/jobs", json=body).json()["cost"]["predicted_cpu_seconds"] == quoted
    other = client.post("/v1/plans", json={"scene": body["scene"]}).json()["cost"]["cpu_seconds"]
    assert other == renderer.compile_scene(body["scene"]).describe().cost.cpu_seconds


def test_more_quotes_than_the_service_makes_are_sent_away(start: Start) -> None:
    server = start(max_quotes=1, workers=1)

    def quoted(_: int) -> httpx2.Response:
        with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
            return ask(client)

    with ThreadPoolExecutor(4) as threads:
        answers = list(threads.map(quoted, range(4)))
    assert {answer.status_code for answer in answers} == {200, 429}
    refused = next(answer for answer in answers if answer.status_code == 429)
    assert problem_of(refused, 429)["code"] == "busy"
    assert int(refused.headers["Retry-After"]) >= 1
    # The limit of concurrent quotes has room again.
    assert quoted(0).status_code == 200


def test_the_client_quotes_scenes_with_their_textures(server: RunningServer) -> None:
    path = Path(__file__).parents[2] / "scenes" / "gallery" / "texturing.json"
    with Client(server.url) as client:
        reported = client.quote(path, target_error=0.02)
        with pytest.raises(RequestInvalidError) as caught:
            client.quote(path, quality={"mode": "fixed", "antialiasing": {"pattern": "cetner"}})
    assert (
        reported.price.camera_rays
        == renderer.compile_scene(renderer.load_scene(path)).describe().cost.camera_rays
    )
    assert caught.value.errors[0].pointer == "/quality/antialiasing/pattern"


def test_a_busy_service_is_a_busy_error_to_the_client(start: Start) -> None:
    server = start(max_quotes=1, workers=1)
    with ThreadPoolExecutor(3) as threads, Client(server.url, retry_seconds=0) as client:
        results = [threads.submit(client.quote, scene()) for _ in range(3)]
        errors = [result.exception() for result in results]
    assert {type(error) for error in errors} <= {BusyError, type(None)}
    assert any(isinstance(error, BusyError) for error in errors)


def test_the_examples_of_the_openapi_document_are_sent_and_answered(client: httpx2.Client) -> None:
    route = client.get("/openapi.json").json()["paths"]["/v1/quotes"]["post"]
    example = route["requestBody"]["content"]["application/json"]["example"]
    answered = route["responses"]["200"]["content"]["application/json"]["example"]
    assert Quote.model_validate(answered).offers
    assert client.post("/v1/quotes", json=example).status_code == 200
