"""Jobs that are rendered until an error is reached."""

import io
import itertools
import os
import signal
from typing import Any

import httpx2
import numpy as np
import pytest

import renderer
from schemas.api.batches import unpack
from schemas.quality import TargetQuality
from service.server import RunningServer
from tests.service.conftest import Start
from tests.service.processes import workers_of
from tests.service.support import ON_BOTH, TIMEOUT, ended, finish, image, job_of, scene, submit, wait

TARGET, LONG = 0.004, 0.0008
LAYERS = ["depth", "samples", "error"]


def target(error: float = TARGET, **more: float) -> dict[str, Any]:
    return {"mode": "target", "error": error, **more}


def rendered(document: dict[str, Any], error: float = TARGET, layers: Any = ()) -> renderer.RenderResult:
    plan = renderer.compile_scene(document, TargetQuality(mode="target", error=error), layers=layers)
    return renderer.render(plan, tile_size=23)


@pytest.mark.slow
@ON_BOTH
def test_picture_and_layers_have_the_bytes_of_the_renderer(client: httpx2.Client) -> None:
    job = submit(client, scene(), quality=target(), layers=LAYERS)
    done = finish(client, job)
    wanted = rendered(scene(), layers=LAYERS)
    assert image(client, job).tobytes() == wanted.image.tobytes()
    for name in LAYERS:
        found = np.load(io.BytesIO(client.get(f"/v1/jobs/{job}/layers/{name}.npy").content))
        assert found.dtype == wanted.layers[name].dtype
        assert found.tobytes() == wanted.layers[name].tobytes(), name
    report = wanted.report
    assert (done["error"], done["numerics"]) == (report["error"], report["numerics"])
    assert (done["cost"]["rays"], done["cost"]["work"]) == (report["rays"], report["work"])


def test_batches_paint_the_picture_pass_by_pass(client: httpx2.Client, server: RunningServer) -> None:
    job = submit(client, scene(), quality=target())
    canvas, after, complete = np.zeros((48, 80, 3), np.float32), 0, False
    shares, totals = [0.0], [0]
    while not complete:
        progress = job_of(client, job)["progress"]
        shares.append(progress["share"])
        totals.append(progress["total"])
        answer = client.get(
            f"/v1/jobs/{job}/tiles",
            params={"after": after, "wait": 5},
            headers={"Accept": "application/octet-stream"},
        )
        head, tiles = unpack(answer.content)
        for place, data in tiles:
            size = place.y1 - place.y0, place.x1 - place.x0, 3
            canvas[place.y0 : place.y1, place.x0 : place.x1] = np.frombuffer(data, "<f4").reshape(size)
        after, complete = head.next, head.complete
    assert canvas.tobytes() == image(client, job).tobytes()
    assert (shares, totals) == (sorted(shares), sorted(totals))

    done = job_of(client, job)
    events = client.get(f"/v1/jobs/{job}/tiles").json()["events"]
    assert [event["seq"] for event in events] == list(range(1, done["last_seq"] + 1))
    whole = {"done": len(events), "total": len(events), "share": 1.0, "remaining_seconds": None}
    assert done["progress"] == whole
    passes = [list(group) for _, group in itertools.groupby(events, key=lambda event: event["pass_index"])]
    assert [group[0]["pass_index"] for group in passes] == list(range(len(passes)))
    for *tiles, picture in passes:
        assert all(event["tile"] > 0 for event in tiles)
        assert [picture[name] for name in ("tile", "x0", "y0", "x1", "y1")] == [0, 0, 0, 80, 48]
    # A preview covers the whole picture before any part of it is refined.
    assert len(passes[0]) == 1 + 3 * 2

    # Nothing but the picture is kept: the last of the passes is composed under the number of its attempt.
    client.get(f"/v1/jobs/{job}/image.png")
    kept = {path.name for path in (server.data / "jobs" / job).iterdir()}
    last = max(int(name.partition("-")[0]) for name in kept - {"spec.json"})
    assert kept == {"spec.json", f"{last}-image.npy", f"{last}-image.png"}


def test_running_job_shows_its_picture_pauses_and_is_cancelled(client: httpx2.Client) -> None:
    document = scene(256, 192)
    quality = target(1e-6, time_limit=20)
    job = submit(client, document, quality=quality, layers=["shape", "error"])
    wait(client, job, lambda found: found["last_seq"] >= 8 * 6 + 1)
    partial, shapes = image(client, job), client.get(f"/v1/jobs/{job}/layers/shape.npy")
    errors = client.get(f"/v1/jobs/{job}/layers/error.npy")
    assert not ended(job_of(client, job))
    client.post(f"/v1/jobs/{job}/pause")
    paused = wait(client, job, lambda found: not found["rendering"])
    assert paused["progress"]["remaining_seconds"] is None
    client.post(f"/v1/jobs/{job}/resume")
    going = wait(client, job, lambda found: found["progress"]["done"] > paused["progress"]["done"])
    assert paused["progress"]["share"] <= going["progress"]["share"] < 1
    assert 0 <= going["progress"]["remaining_seconds"] <= 20
    cancelled = client.post(f"/v1/jobs/{job}/cancel").json()
    assert (cancelled["state"], cancelled["progress"]["remaining_seconds"]) == ("cancelled", None)
    few = renderer.render(renderer.compile_scene(document, layers=["shape"]), workers=1)
    # Pilot samples fill squares of 8 x 8 pixels: on average they are right.
    assert abs(float(partial.mean()) - float(few.image.mean())) < 0.1 * float(few.image.mean())
    assert np.array_equal(np.load(io.BytesIO(shapes.content)), few.layers["shape"])
    assert errors.json()["code"] == "picture_not_ready"
    assert job_of(client, job)["progress"] == cancelled["progress"]


def test_time_limit_ends_with_a_whole_picture(client: httpx2.Client) -> None:
    job = submit(client, scene(256, 192), quality=target(1e-6, time_limit=1))
    done = finish(client, job)
    assert done["error"]["estimate"] > 1e-6
    assert done["progress"]["done"] == done["progress"]["total"] == done["last_seq"]
    found = image(client, job)
    assert np.isfinite(found).all()
    # The ball shows 0.1 x 0.1 where no light falls on it; a hole would be 0.
    assert found.min() > 0.009


@pytest.mark.slow
def test_killed_worker_and_server_change_no_byte(start: Start) -> None:
    steps = 40
    first = start(tile_size=64)
    with httpx2.Client(base_url=first.url, timeout=TIMEOUT) as client:
        job = submit(client, scene(256, 192), quality=target(LONG))
        wait(client, job, lambda found: found["progress"]["done"] >= 3)
        for worker in workers_of(first.process.pid):
            os.kill(worker, signal.SIGKILL)
        wait(client, job, lambda found: found["progress"]["done"] >= steps)
        first.process.kill()
        first.process.wait()
    # Tiles of another size from now on change nothing either.
    with httpx2.Client(base_url=start(tile_size=48).url, timeout=TIMEOUT) as client:
        before = client.get(f"/v1/jobs/{job}/tiles").json()["events"]
        finish(client, job)
        after = client.get(f"/v1/jobs/{job}/tiles").json()["events"]
        assert len(before) >= steps
        assert after[: len(before)] == before
        assert image(client, job).tobytes() == rendered(scene(256, 192), LONG).image.tobytes()


@pytest.mark.parametrize("path", ["/v1/jobs", "/v1/plans"])
def test_too_small_an_error_is_refused(client: httpx2.Client, path: str) -> None:
    request = {"scene": scene(1000, 900), "quality": target(1e-6)}
    answer = client.post(path, json=request)
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert (error["pointer"], error["code"]) == ("/quality/error", "cost")
    request["quality"] |= {"time_limit": 1}
    assert client.post("/v1/plans", json=request).status_code == 200
