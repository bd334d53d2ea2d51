"""Error against time over HTTP: as a document, a table and a plot."""

import csv
import io
import time
from typing import Any
from xml.etree import ElementTree

import httpx2
import pytest
from PIL import Image

import renderer
from schemas.quality import TargetQuality
from tests.service.in_process import InProcess
from tests.service.support import finish, job_of, long_scene, scene, submit, wait

TARGET = {"mode": "target", "error": 0.004}
RANDOM = {"samples": 64, "pattern": "random", "light_pattern": "stratified"}
MEDIA_TYPES = {
    "json": "application/json",
    "csv": "text/csv; charset=utf-8",
    "svg": "image/svg+xml",
    "png": "image/png",
}


def path_of(job: str) -> str:
    return f"/v1/jobs/{job}/convergence"


def convergence(client: httpx2.Client, job: str) -> dict[str, Any]:
    answer = client.get(path_of(job))
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def rays(passes: list[dict[str, Any]]) -> list[dict[str, int]]:
    return [entry["rays"] for entry in passes]


@pytest.fixture(scope="module")
def target_job(local: InProcess) -> str:
    with local.client() as client:
        return finish(client, submit(client, scene(), quality=TARGET))["id"]


@pytest.fixture(scope="module")
def random_job(local: InProcess) -> str:
    with local.client() as client:
        return finish(client, submit(client, scene(**RANDOM)))["id"]


def test_passes_of_target_quality_are_those_of_the_renderer(api: httpx2.Client, target_job: str) -> None:
    found = convergence(api, target_job)
    plan = renderer.compile_scene(scene(), TargetQuality(**TARGET))
    wanted = renderer.render(plan, tile_size=23).report["passes"]
    assert (found["job"], found["state"], found["mode"]) == (target_job, "succeeded", "target")
    assert found["target_error"] == TARGET["error"]
    assert [entry["pass_index"] for entry in found["passes"]] == list(range(len(wanted)))
    assert rays(found["passes"]) == rays(wanted)
    assert [entry["error"] for entry in found["passes"]] == [entry["error"] for entry in wanted]


def test_passes_of_random_samples_are_those_of_the_renderer(api: httpx2.Client, random_job: str) -> None:
    found = convergence(api, random_job)
    report = renderer.render(renderer.compile_scene(scene(**RANDOM)), on_tile=lambda _: None).report
    assert (found["mode"], found["target_error"]) == ("fixed", None)
    assert rays(found["passes"]) == rays(report["passes"])
    assert [entry["error"] is None for entry in found["passes"]] == [True, True, False, False, False]
    for entry, wanted in zip(found["passes"][2:], report["passes"][2:], strict=True):
        # Tiles of another size: sums are rounded in another order.
        assert entry["error"] == pytest.approx(wanted["error"], rel=1e-9)


@pytest.mark.parametrize(
    ("sampling", "reason"),
    [
        ({"pattern": "stratified", "light_pattern": "random"}, "'stratified'"),
        ({"pattern": "random", "light_pattern": "random", "samples": 1}, "one camera sample"),
    ],
)
def test_error_that_passes_cannot_estimate_is_null_with_a_reason(
    api: httpx2.Client, sampling: dict[str, Any], reason: str
) -> None:
    job = submit(api, scene(**sampling))
    finish(api, job)
    found = convergence(api, job)
    assert {entry["error"] for entry in found["passes"]} == {None}
    assert (found["order"], found["next_halving"]) == (None, None)
    assert reason in found["reason"]
    assert job_of(api, job)["error"] is None
    svg = api.get(path_of(job), params={"format": "svg"})
    words = " ".join("".join(ElementTree.fromstring(svg.content).itertext()).split())  # noqa: S314 - our own
    assert reason in words


@pytest.mark.slow
def test_passes_are_told_while_a_job_runs_and_after_it_was_cancelled(api: httpx2.Client) -> None:
    job = submit(api, long_scene(), quality=TARGET)
    tags: dict[str, str] = {}

    def two_passes(_: dict[str, Any]) -> bool:
        answer = api.get(path_of(job))
        assert tags.setdefault(answer.headers["ETag"], answer.text) == answer.text
        return len(answer.json()["passes"]) >= 2

    wait(api, job, two_passes)
    found = convergence(api, job)
    api.post(f"/v1/jobs/{job}/cancel")
    cancelled = convergence(api, job)
    assert (found["state"], cancelled["state"]) == ("running", "cancelled")
    assert found["passes"][0]["rays"]["camera"] == cancelled["passes"][0]["rays"]["camera"] > 0
    # A tag changes with the content, and with the form.
    tags[api.get(path_of(job), params={"format": "csv"}).headers["ETag"]] = "csv"
    assert len(tags) >= 3


def test_table_has_the_same_numbers(api: httpx2.Client, target_job: str) -> None:
    found = convergence(api, target_job)
    answer = api.get(path_of(target_job), params={"format": "csv"})
    assert answer.text.count("\r\n") == 1 + len(found["passes"])
    rows = csv.DictReader(io.StringIO(answer.text, newline=""))
    for row, entry in zip(rows, found["passes"], strict=True):
        assert int(row["pass_index"]) == entry["pass_index"]
        assert float(row["seconds"]) == entry["seconds"]
        assert float(row["cpu_seconds"]) == entry["cpu_seconds"]
        assert {name: int(row[f"rays_{name}"]) for name in entry["rays"]} == entry["rays"]
        for end in ("estimate", "low", "high"):
            reported = row[f"error_{end}"]
            assert (float(reported) if reported else None) == (entry["error"] and entry["error"][end])


@pytest.mark.parametrize("form", list(MEDIA_TYPES))
def test_form_is_chosen_by_its_name_or_its_media_type(api: httpx2.Client, target_job: str, form: str) -> None:
    path, params = path_of(target_job), {"format": form}
    named = api.get(path, params=params, headers={"Accept": "text/html"})
    accepted = api.get(path, headers={"Accept": MEDIA_TYPES[form].partition(";")[0]})
    assert named.headers["Content-Type"] == accepted.headers["Content-Type"] == MEDIA_TYPES[form]
    assert named.content == accepted.content
    if form == "svg":
        words = "".join(ElementTree.fromstring(named.content).itertext())  # noqa: S314 - our own server
        assert target_job in words
    elif form == "png":
        assert Image.open(io.BytesIO(named.content)).size == (960, 630)
    assert (named.headers["Vary"], named.headers["Cache-Control"]) == ("Accept", "private, no-cache")
    again = api.get(path, params=params, headers={"If-None-Match": named.headers["ETag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_plot_is_drawn_once(api: httpx2.Client, target_job: str, random_job: str) -> None:
    def drawn(job: str, times: int) -> float:
        """Processor seconds that this process, with the service in it, takes for the plot of a job."""
        before = time.process_time()
        for _ in range(times):
            assert api.get(path_of(job), params={"format": "png"}).headers["Content-Type"] == "image/png"
        return time.process_time() - before

    # The first loads the library.
    drawn(target_job, 1)
    once = drawn(random_job, 1)
    assert drawn(random_job, 20) < 10 * once
