"""Pixels explained and pictures priced, over HTTP: what workers compute while a client waits."""

import json
import os
import signal
import socket
from collections import Counter
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import httpx2
import pytest
from sqlalchemy import select

import renderer
import scenes
from accuracy.inspection import inspect, inspection_plan
from schemas.api.administration import Role
from schemas.api.inspections import Inspection
from schemas.api.plans import Quote
from schemas.api.request_pointers import in_scene
from schemas.quality import FixedQuality
from service.server import RunningServer
from service.settings import Settings
from service.storage.database.models import ShareRow
from tests.service.conftest import Start
from tests.service.in_process import InProcess, in_process
from tests.service.processes import held, is_alive, ticks_of, workers_of
from tests.service.sending import bearer, client_of, connected, make_keys, mistakes, problem_of, put
from tests.service.support import finish, long_scene, scene, submit, until

BEHIND_THE_BALL = (30, 27)


@pytest.fixture(scope="module")
def finished(local: InProcess) -> str:
    with local.client() as client:
        return finish(client, submit(client, scene()))["id"]


def pixel(client: httpx2.Client, job: str, place: Any) -> httpx2.Response:
    return client.post(f"/v1/jobs/{job}/inspections", json=place)


def test_pixel_is_explained_as_by_the_renderer(api: httpx2.Client, finished: str) -> None:
    x, y = BEHIND_THE_BALL
    answer = pixel(api, finished, {"x": x, "y": y})
    assert answer.status_code == 200, answer.text
    plan = inspection_plan(renderer.load_scene(scene()))
    assert in_scene(Inspection.model_validate(answer.json())) == inspect(plan, x, y)
    # The ball stands before the light.
    assert answer.json()["reasons"][0]["pointers"] == ["/scene/lights/0", "/scene/shapes/1"]


def test_pixel_of_a_job_that_has_not_begun_is_explained(api: httpx2.Client) -> None:
    job = submit(api, long_scene(), quality={"mode": "target", "error": 0.02})
    assert pixel(api, job, {"x": 0, "y": 0}).json()["reasons"][0]["code"] == "background"
    api.delete(f"/v1/jobs/{job}")
    problem_of(pixel(api, job, {"x": 0, "y": 0}), 404)


def test_pixel_outside_the_picture_is_pointed_at(api: httpx2.Client, finished: str) -> None:
    wrong = {"/x": [{"x": 80, "y": 0}, {"x": -1, "y": 0}, {"x": 1.5, "y": 0}], "/y": [{"x": 0, "y": 48}]}
    for pointer, places in (wrong | {"": [{"x": 1}]}).items():
        for place in places:
            assert mistakes(pixel(api, finished, place))[0][0] == pointer


def quote(client: httpx2.Client, **changes: Any) -> httpx2.Response:
    return client.post("/v1/quotes", json={"scene": scene()} | changes)


def quoted(answer: httpx2.Response) -> Quote:
    assert answer.status_code == 200, answer.text
    return Quote.model_validate(answer.json())


def test_quote_prices_what_is_asked_for_and_other_qualities(api: httpx2.Client) -> None:
    reported = quoted(quote(api, target_error=0.02, seconds=60))
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


def test_quote_of_a_long_render_takes_no_longer(api: httpx2.Client) -> None:
    # The whole picture would take hours.
    document = scene(1000, 1000, samples=1024, light_samples=1024)
    reported = quoted(quote(api, scene=document))
    assert reported.pilot.seconds < 60
    assert reported.asked is None or reported.asked.cpu_seconds.estimate > 600


def test_quote_is_the_price_at_which_a_job_is_admitted(api: httpx2.Client) -> None:
    quality = {"mode": "fixed", "antialiasing": {"pattern": "sobol", "samples": 2}}
    body = {"scene": scene(64, 64), "quality": quality}
    reported = quoted(api.post("/v1/quotes", json=body))
    assert reported.asked is not None
    price = reported.asked.cpu_seconds.estimate
    assert api.post("/v1/plans", json=body).json()["cost"]["cpu_seconds"] == price
    assert api.post("/v1/jobs", json=body).json()["cost"]["predicted_cpu_seconds"] == price
    other = api.post("/v1/plans", json={"scene": body["scene"]}).json()["cost"]["cpu_seconds"]
    assert other == renderer.compile_scene(body["scene"]).describe().cost.cpu_seconds


def test_quote_of_what_makes_no_sense_is_pointed_at(api: httpx2.Client) -> None:
    wrong: list[tuple[str, dict[str, Any]]] = [
        ("/target_error", {"target_error": 0}),
        ("/seconds", {"seconds": 1e6}),
        ("/quality/mode", {"quality": {"mode": "quick"}}),
        ("/layers", {"layers": ["depth"]}),
        ("/scene/camera", {"scene": scene() | {"camera": {}}}),
        ("/scene/camera", {"scene": scene(2000, 2000)}),
    ]
    for pointer, changes in wrong:
        assert mistakes(quote(api, **changes))[0][0].startswith(pointer)


def test_quote_of_a_damaged_mesh_fails(api: httpx2.Client) -> None:
    name = put(api, b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n").json()["name"]
    mesh = {"type": "mesh", "asset": name, "material": "ball"}
    answer = quote(api, scene=scene() | {"shapes": [mesh]})
    assert problem_of(answer, 422)["code"] == "quote_failed"


def test_calls_of_one_user_leave_room_for_another(tmp_path: Path) -> None:
    made = make_keys(tmp_path, ann=Role.SUBMIT, bob=Role.SUBMIT)
    others, most = set(workers_of(os.getpid())), 6
    with (
        in_process(Settings(data=tmp_path, workers=1, max_user_calls=most)) as local,
        local.client(headers=bearer(made["ann"])) as ann,
        local.client(headers=bearer(made["bob"])) as bob,
        ThreadPoolExecutor(most + 1) as threads,
    ):
        (worker,) = {*workers_of(os.getpid())} - others
        ball = scene()["shapes"][1]
        dear = {
            "scene": scene(16, 16) | {"shapes": [ball | {"center": [0, n / 9, 0]} for n in range(40)]},
            "quality": {"mode": "target", "error": 0.1},
        }
        with held(worker):
            planned = [threads.submit(ann.post, path, json=dear) for path in ("/v1/plans", "/v1/jobs")]
            job = submit(bob, scene(8, 8, samples=1))
            assert not any(call.done() for call in planned)
        plan, sent = (call.result() for call in planned)
        assert (plan.status_code, sent.status_code) == (200, 202)
        assert plan.json()["cost"]["cpu_seconds"] == sent.json()["cost"]["predicted_cpu_seconds"]
        finish(ann, sent.json()["id"])
        finish(bob, job)

        rays = {"origins": [[0, 2, 6]] * 100, "directions": [[0, -0.2, -1]] * 100}
        with held(worker):
            body = {"scene": scene(light_samples=4096)} | rays
            calls = [threads.submit(ann.post, "/v1/traces", json=body) for _ in range(most + 1)]
            refused = next(as_completed(calls)).result()
            assert problem_of(refused, 429)["code"] == "busy"
            assert int(refused.headers["Retry-After"]) >= 1
            job = submit(bob, scene(8, 8, samples=1))
            asked = threads.submit(bob.post, "/v1/traces", json={"scene": scene()} | rays)
        assert asked.result().status_code == 200
        finish(bob, job)
        assert not all(call.done() for call in calls)
        assert Counter(call.result().status_code for call in calls) == {200: most, 429: 1}
        with local.service.database.reading() as session:
            served = {share.owner: share.served for share in session.scalars(select(ShareRow))}
        assert served["ann"] > served["bob"] > 0


def sent(server: RunningServer, path: str, body: Any) -> socket.socket:
    """A connection on which a request was sent and nothing was received."""
    content = json.dumps(body).encode()
    head = f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: {len(content)}\r\n\r\n"
    return connected(server, head.encode() + content)


@pytest.mark.parametrize("path", ["/v1/quotes", pytest.param("/v1/previews", marks=pytest.mark.slow)])
def test_call_ends_when_its_client_disconnects(start: Start, path: str) -> None:
    """It would not end by itself, as its worker is stopped, nor be found silent within the test."""
    server = start(workers=1, worker_silence_seconds=3600)
    body = {"scene": json.loads((Path(str(scenes.__file__)).parent / "gallery/glass.json").read_text())}
    (worker,) = workers_of(server.process.pid)
    before = ticks_of(worker)
    with sent(server, path, body):
        until(lambda: ticks_of(worker) > before + 5)
        os.kill(worker, signal.SIGSTOP)
    until(lambda: not is_alive(worker))
    with client_of(server) as client:
        assert client.post(path, json={"scene": scene(8, 8)}).status_code == 200
