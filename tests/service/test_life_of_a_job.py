"""A scene sent over HTTP becomes the image that the renderer makes."""

from __future__ import annotations

import io
from typing import Any

import httpx2
import numpy as np
import pytest
from PIL import Image

import renderer
from renderer.images.files import displayed
from schemas.api.jobs import JobRequest
from schemas.api.request_pointers import in_request
from tests.service.conftest import Start
from tests.service.support import (
    ON_BOTH,
    TIMEOUT,
    ended,
    finish,
    image,
    job_of,
    long_scene,
    scene,
    submit,
)

RANDOM = {"pattern": "random", "light_pattern": "random"}


def rendered(document: dict[str, Any]) -> np.ndarray:
    return renderer.render(renderer.compile_scene(document), workers=1).image


@ON_BOTH
def test_the_image_has_the_bytes_that_the_renderer_makes(client: httpx2.Client) -> None:
    document = scene(**RANDOM)
    job = submit(client, document)
    done = finish(client, job)
    assert done["progress"] == {
        "done": done["progress"]["total"],
        "total": done["last_seq"],
        "share": 1.0,
        "remaining_seconds": None,
    }
    assert image(client, job).tobytes() == rendered(document).tobytes()


def test_the_png_shows_the_image_as_its_scene_asks(client: httpx2.Client) -> None:
    document = scene() | {"display": {"transfer": "srgb", "exposure": 1}}
    job = submit(client, document)
    finish(client, job)
    png = np.asarray(Image.open(io.BytesIO(client.get(f"/v1/jobs/{job}/image.png").content)))
    shown = displayed(rendered(document), renderer.load_scene(document).document.display)
    assert np.array_equal(png, shown)


def test_the_quality_of_a_request_takes_the_place_of_the_scenes_sampling(client: httpx2.Client) -> None:
    light = {"pattern": "uniform", "samples": 1}
    quality = {"mode": "fixed", "antialiasing": {"pattern": "center", "samples": 1}, "light": light}
    job = submit(client, scene(samples=16), quality=quality)
    finish(client, job)
    wanted = rendered(scene(samples=1, light_samples=1, pattern="center"))
    assert image(client, job).tobytes() == wanted.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize(("tile_size", "workers"), [(16, 2), (256, 1)])
@pytest.mark.parametrize("patterns", [{}, RANDOM], ids=["uniform", "random"])
def test_bytes_do_not_depend_on_tiles_and_workers(
    start: Start, tile_size: int, workers: int, patterns: dict[str, str]
) -> None:
    document = scene(150, 90, **patterns)
    server = start(tile_size=tile_size, workers=workers)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        job = submit(client, document)
        finish(client, job)
        assert image(client, job).tobytes() == rendered(document).tobytes()


@ON_BOTH
def test_waiting_for_the_end_answers_with_the_end(client: httpx2.Client) -> None:
    answer = client.post("/v1/jobs", json={"scene": scene()}, headers={"Prefer": "wait=5"})
    assert answer.status_code == 202
    assert answer.headers["Preference-Applied"] == "wait=5"
    assert ended(answer.json())


def test_the_answer_says_where_the_job_is(client: httpx2.Client) -> None:
    answer = client.post("/v1/jobs", json={"scene": scene()})
    job = answer.json()
    assert answer.headers["Location"] == job["links"]["self"]
    assert client.get(job["links"]["self"]).json()["id"] == job["id"]
    finish(client, job["id"])


@ON_BOTH
def test_jobs_are_listed_newest_first_page_by_page(client: httpx2.Client) -> None:
    sent = [submit(client, scene(8, 8)) for _ in range(5)]
    first = client.get("/v1/jobs", params={"limit": 2}).json()
    second = client.get("/v1/jobs", params={"limit": 3, "cursor": first["next"]}).json()
    listed = [job["id"] for job in first["jobs"] + second["jobs"]]
    assert listed == sent[::-1]


def test_the_last_page_has_no_next(client: httpx2.Client) -> None:
    submit(client, scene(8, 8))
    page = client.get("/v1/jobs", params={"limit": 100}).json()
    assert page["next"] is None


@ON_BOTH
def test_a_deleted_job_is_gone_with_all_it_made(client: httpx2.Client) -> None:
    job = submit(client, scene())
    finish(client, job)
    assert client.delete(f"/v1/jobs/{job}").status_code == 204
    paths = ["", "/tiles", "/events", "/plan", "/image.png", "/image.npy"]
    assert [client.get(f"/v1/jobs/{job}{path}").status_code for path in paths] == [404] * 6
    assert job not in [listed["id"] for listed in client.get("/v1/jobs").json()["jobs"]]


def test_a_job_counts_the_rays_of_its_samples_and_of_its_coarse_picture(client: httpx2.Client) -> None:
    job = submit(client, scene(64, 64, samples=4))
    cost = finish(client, job)["cost"]
    stride = client.get(f"/v1/jobs/{job}/tiles").json()["events"][0]["stride"]
    assert cost["rays"]["camera"] == 64 * 64 * 4 + (64 // stride) ** 2
    assert cost["cpu_seconds"] > 0


def test_a_job_counts_the_same_work_as_rendering_in_process_and_keeps_zeros(client: httpx2.Client) -> None:
    document = scene(64, 48, samples=4)
    cost = finish(client, submit(client, document))["cost"]
    report = renderer.render(renderer.compile_scene(document), on_tile=lambda _: None).report
    assert cost["rays"] == report["rays"]
    assert cost["work"] == report["work"]
    assert cost["work"]["shading_points"] > 0
    assert cost["rays"]["mirror"] == cost["work"]["texture_lookups"] == 0


def test_a_job_reports_the_same_numerics_as_rendering_in_process(client: httpx2.Client) -> None:
    """A triangle without area, one of 1e-14 of its width, and a floor brighter than float32."""
    document = scene()
    document["ambient"] = document["materials"]["floor"]["color"] = [1e30] * 3
    document["shapes"] += [
        {"type": "triangle", "vertices": [[0, 0, 0], [1, 0, 0], [0.5, height, 0]], "material": "ball"}
        for height in (0, 1e-14)
    ]
    reported = finish(client, submit(client, document))["numerics"]
    assert (reported["non_finite"], reported["degenerate_dropped"], reported["retried"]) == (0, 1, 2)
    assert reported["clamped"] > 0
    assert reported == renderer.render(renderer.compile_scene(document)).report["numerics"]


def test_nothing_is_said_of_numbers_before_the_picture_is_finished(client: httpx2.Client) -> None:
    job = submit(client, long_scene())
    assert job_of(client, job)["numerics"] is None


def test_warnings_come_with_the_job(client: httpx2.Client) -> None:
    job = submit(client, scene() | {"lights": []})
    (warning,) = job_of(client, job)["warnings"]
    assert warning["pointer"].startswith("/scene")


def test_the_plan_of_a_job_is_the_plan_of_its_scene(client: httpx2.Client) -> None:
    job = submit(client, scene())
    plan = client.post("/v1/plans", json={"scene": scene()}).json()
    assert client.get(f"/v1/jobs/{job}/plan").json() == plan
    described = renderer.compile_scene(scene()).describe()
    request = JobRequest.model_validate({"scene": scene()})
    assert plan == in_request(described, request).model_dump(mode="json")
