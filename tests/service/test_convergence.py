"""What the error of a picture costs, over HTTP: as a document, as a table and as a plot."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import httpx2
import numpy as np
import pytest
from PIL import Image

import renderer
from renderer.convergence import trend
from schemas.api.plans import Convergence
from schemas.quality import TargetQuality
from service.api.routes.pictures import CONVERGENCE_EXAMPLE as EXAMPLE
from tests.service.conftest import Start
from tests.service.support import TIMEOUT, finish, job_of, long_scene, scene, submit, wait

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


@pytest.fixture
def target_job(client: httpx2.Client) -> str:
    job = submit(client, scene(), quality=TARGET)
    finish(client, job)
    return job


@pytest.fixture
def random_job(client: httpx2.Client) -> str:
    job = submit(client, scene(**RANDOM))
    finish(client, job)
    return job


def test_the_passes_of_target_quality_are_those_of_the_renderer(
    client: httpx2.Client, target_job: str
) -> None:
    found, job = convergence(client, target_job), job_of(client, target_job)
    plan = renderer.compile_scene(scene(), TargetQuality(**TARGET))
    wanted = renderer.render(plan, tile_size=23).report["passes"]
    assert (found["job"], found["state"], found["mode"]) == (target_job, "succeeded", "target")
    assert found["target_error"] == TARGET["error"]
    assert [entry["pass_index"] for entry in found["passes"]] == list(range(len(wanted)))
    assert rays(found["passes"]) == rays(wanted)
    assert [entry["error"] for entry in found["passes"]] == [entry["error"] for entry in wanted]
    assert found["passes"][-1]["error"] == job["error"]
    assert found["passes"][-1]["rays"] == job["cost"]["rays"]
    assert found["passes"][-1]["cpu_seconds"] == pytest.approx(job["cost"]["cpu_seconds"])


def test_the_passes_of_random_samples_report_the_error_that_the_renderer_reports(
    client: httpx2.Client, random_job: str
) -> None:
    found, job = convergence(client, random_job), job_of(client, random_job)
    events: list[renderer.TileEvent] = []
    report = renderer.render(renderer.compile_scene(scene(**RANDOM)), on_tile=events.append).report
    assert (found["mode"], found["target_error"]) == ("fixed", None)
    assert rays(found["passes"]) == rays(report["passes"])
    assert [entry["error"] is None for entry in found["passes"]] == [True, True, False, False, False]
    for entry, wanted in zip(found["passes"][2:], report["passes"][2:], strict=True):
        # Tiles of another size: sums are rounded in another order.
        assert entry["error"] == pytest.approx(wanted["error"], rel=1e-9)
    assert job["error"] == found["passes"][-1]["error"]
    assert found["passes"][-1]["rays"] == job["cost"]["rays"]


@pytest.mark.parametrize("fixture", ["target_job", "random_job"])
def test_times_only_grow_and_the_fit_is_that_of_the_passes(
    client: httpx2.Client, fixture: str, request: pytest.FixtureRequest
) -> None:
    found = convergence(client, request.getfixturevalue(fixture))
    for clock in ("seconds", "cpu_seconds"):
        times = [entry[clock] for entry in found["passes"]]
        assert times == sorted(times)
        assert times[0] > 0
    reported = {name: found[name] for name in ("order", "next_halving", "reason")}
    assert reported == trend(found["passes"])
    job = job_of(client, found["job"])
    assert found["passes"][-1]["cpu_seconds"] == pytest.approx(job["cost"]["cpu_seconds"])


@pytest.mark.parametrize(
    ("sampling", "reason"),
    [
        ({"pattern": "stratified", "light_pattern": "random"}, "'stratified'"),
        ({"pattern": "random", "light_pattern": "uniform"}, "'uniform'"),
        ({"pattern": "random", "light_pattern": "random", "samples": 1}, "one camera sample"),
    ],
)
def test_where_passes_cannot_estimate_the_error_it_is_null_with_a_reason(
    client: httpx2.Client, sampling: dict[str, Any], reason: str
) -> None:
    job = submit(client, scene(**sampling))
    finish(client, job)
    found = convergence(client, job)
    assert {entry["error"] for entry in found["passes"]} == {None}
    assert (found["order"], found["next_halving"]) == (None, None)
    assert reason in found["reason"]
    assert found["passes"][-1]["rays"] == job_of(client, job)["cost"]["rays"]
    assert job_of(client, job)["error"] is None


def test_a_running_job_reports_the_passes_that_are_finished(client: httpx2.Client) -> None:
    document = long_scene()
    document["sampling"]["antialiasing"]["pattern"] = "random"
    document["sampling"]["light"]["pattern"] = "random"
    job = submit(client, document)
    wait(client, job, lambda _: len(convergence(client, job)["passes"]) == 2)
    found = convergence(client, job)
    client.delete(f"/v1/jobs/{job}")
    assert found["state"] == "running"
    # The preview has a ray for each 4 x 4 pixels, the next pass one for each pixel.
    previews = 64 * 64
    assert [entry["rays"]["camera"] for entry in found["passes"]][:2] == [previews, previews + 256 * 256]
    assert "when the picture is finished" in found["reason"]


def test_a_cancelled_job_still_reports_what_it_took(client: httpx2.Client) -> None:
    job = submit(client, long_scene())
    wait(client, job, lambda _: len(convergence(client, job)["passes"]) > 0)
    client.post(f"/v1/jobs/{job}/cancel")
    found = convergence(client, job)
    assert found["state"] == "cancelled"
    assert found["passes"][0]["rays"]["camera"] == 64 * 64


def rows_of(answer: httpx2.Response) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(answer.text, newline="")))


def test_the_table_has_the_same_numbers(client: httpx2.Client, target_job: str) -> None:
    found = convergence(client, target_job)
    answer = client.get(path_of(target_job), params={"format": "csv"})
    assert answer.text.count("\r\n") == 1 + len(found["passes"])
    for row, entry in zip(rows_of(answer), found["passes"], strict=True):
        assert int(row["pass_index"]) == entry["pass_index"]
        assert float(row["seconds"]) == entry["seconds"]
        assert float(row["cpu_seconds"]) == entry["cpu_seconds"]
        assert {name: int(row[f"rays_{name}"]) for name in entry["rays"]} == entry["rays"]
        for end in ("estimate", "low", "high"):
            reported = row[f"error_{end}"]
            assert (float(reported) if reported else None) == (entry["error"] and entry["error"][end])
    assert len(row) == 3 + len(entry["rays"]) + 3


def test_the_plots_are_what_they_say(client: httpx2.Client, target_job: str) -> None:
    svg = client.get(path_of(target_job), params={"format": "svg"})
    words = "".join(ElementTree.fromstring(svg.content).itertext())  # noqa: S314 - our own server
    assert target_job in words
    assert "asked for: 0.004" in words
    png = client.get(path_of(target_job), params={"format": "png"})
    picture = Image.open(io.BytesIO(png.content))
    assert (picture.format, picture.size) == ("PNG", (960, 630))
    assert np.asarray(picture.convert("L")).min() < 50


def test_a_plot_of_what_is_not_known_says_why(client: httpx2.Client) -> None:
    job = submit(client, scene())
    finish(client, job)
    svg = client.get(path_of(job), params={"format": "svg"})
    words = " ".join("".join(ElementTree.fromstring(svg.content).itertext()).split())  # noqa: S314 - our own
    assert "'uniform'" in words


@pytest.mark.parametrize("form", list(MEDIA_TYPES))
def test_a_form_is_chosen_by_its_name_or_its_media_type(
    client: httpx2.Client, target_job: str, form: str
) -> None:
    media_type = MEDIA_TYPES[form]
    named = client.get(path_of(target_job), params={"format": form}, headers={"Accept": "text/html"})
    accepted = client.get(path_of(target_job), headers={"Accept": media_type.partition(";")[0]})
    assert named.headers["Content-Type"] == accepted.headers["Content-Type"] == media_type
    assert named.content == accepted.content
    assert named.headers["Vary"] == "Accept"


@pytest.mark.parametrize(
    ("accept", "form"),
    [
        ("*/*", "json"),
        ("text/html,application/xhtml+xml,*/*;q=0.8", "json"),
        ("image/*", "svg"),
        ("image/svg+xml;q=0.5, image/png", "png"),
        ("application/pdf", "json"),
        ("text/csv;q=high, image/png;q=0.1", "png"),
        ("image/png;q=0, text/csv;q=0.1", "csv"),
    ],
)
def test_the_preferred_form_is_sent(client: httpx2.Client, target_job: str, accept: str, form: str) -> None:
    answer = client.get(path_of(target_job), headers={"Accept": accept})
    assert answer.headers["Content-Type"] == MEDIA_TYPES[form]


def test_an_unknown_form_is_refused_with_those_there_are(client: httpx2.Client, target_job: str) -> None:
    answer = client.get(path_of(target_job), params={"format": "pdf"})
    assert answer.status_code == 422
    assert answer.headers["Content-Type"] == "application/problem+json"
    for form in MEDIA_TYPES:
        assert f"'{form}'" in answer.json()["detail"]


def test_an_unknown_job_has_no_convergence(client: httpx2.Client) -> None:
    answer = client.get(path_of("none"), params={"format": "png"})
    assert (answer.status_code, answer.json()["code"]) == (404, "unknown_job")


@pytest.mark.parametrize("form", list(MEDIA_TYPES))
def test_what_the_client_has_already_costs_nothing(client: httpx2.Client, target_job: str, form: str) -> None:
    whole = client.get(path_of(target_job), params={"format": form})
    again = client.get(
        path_of(target_job), params={"format": form}, headers={"If-None-Match": whole.headers["ETag"]}
    )
    assert (again.status_code, again.content) == (304, b"")
    assert whole.headers["Cache-Control"] == "private, no-cache"
    head = client.head(path_of(target_job), params={"format": form})
    assert (head.status_code, head.content, head.headers["ETag"]) == (200, b"", whole.headers["ETag"])


def test_the_tag_changes_with_the_form_and_the_content(client: httpx2.Client) -> None:
    job = submit(client, long_scene(), quality=TARGET)
    tags: dict[str, str] = {}

    def three_passes(_: dict[str, Any]) -> bool:
        answer = client.get(path_of(job))
        assert tags.setdefault(answer.headers["ETag"], answer.text) == answer.text
        return len(answer.json()["passes"]) >= 3

    wait(client, job, three_passes)
    tags[client.get(path_of(job), params={"format": "csv"}).headers["ETag"]] = "csv"
    client.delete(f"/v1/jobs/{job}")
    assert len(tags) >= 3


def test_the_links_of_a_job_lead_to_it(client: httpx2.Client, target_job: str) -> None:
    link = job_of(client, target_job)["links"]["convergence"]
    assert client.get(link).json()["job"] == target_job


def test_the_example_of_the_description_is_an_answer(client: httpx2.Client) -> None:
    described = client.get("/openapi.json").json()["paths"]["/v1/jobs/{job_id}/convergence"]["get"]
    content = described["responses"]["200"]["content"]
    assert content["application/json"]["example"] == EXAMPLE
    assert set(content) == {media_type.partition(";")[0] for media_type in MEDIA_TYPES.values()}
    example = Convergence.model_validate(EXAMPLE)
    wanted = trend([entry.model_dump() for entry in example.passes])
    # The numbers of the example are written with three digits.
    assert example.order is not None
    assert example.order.model_dump() == pytest.approx(wanted["order"], rel=5e-3)
    assert example.next_halving is not None
    for clock, cost in example.next_halving:
        assert cost.model_dump() == pytest.approx(wanted["next_halving"][clock], rel=5e-3)


def test_without_the_extra_a_plot_is_refused_with_the_cure(
    start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    missing = tmp_path / "missing"
    missing.mkdir()
    (missing / "matplotlib.py").write_text("raise ImportError")
    monkeypatch.setenv("PYTHONPATH", str(missing))
    with httpx2.Client(base_url=start().url, timeout=TIMEOUT) as client:
        job = submit(client, scene(8, 8, samples=1))
        for form in ("svg", "png"):
            answer = client.get(path_of(job), params={"format": form})
            assert answer.status_code == 501
            assert answer.headers["Content-Type"] == "application/problem+json"
            assert "pip install 'penumbra-render[study]'" in answer.json()["detail"]
        assert client.get(path_of(job), params={"format": "csv"}).status_code == 200
        finish(client, job)


@pytest.mark.slow
@pytest.mark.parametrize("quality", [None, {"mode": "target", "error": 0.0008}], ids=["fixed", "target"])
def test_a_killed_server_forgets_no_pass_and_counts_none_twice(
    start: Start, quality: dict[str, Any] | None
) -> None:
    document = scene(256, 192, samples=64, light_samples=16, pattern="random", light_pattern="random")
    first = start(tile_size=64)
    with httpx2.Client(base_url=first.url, timeout=TIMEOUT) as client:
        job = submit(client, document, **({"quality": quality} if quality else {}))
        wait(client, job, lambda _: len(convergence(client, job)["passes"]) >= 2)
        before = convergence(client, job)["passes"]
        first.process.kill()
        first.process.wait()
    with httpx2.Client(base_url=start(tile_size=64).url, timeout=TIMEOUT) as client:
        done = finish(client, job)
        passes = convergence(client, job)["passes"]
    assert [entry["seconds"] for entry in passes[: len(before)]] == [entry["seconds"] for entry in before]
    assert rays(passes)[: len(before)] == rays(before)
    assert passes[-1]["rays"] == done["cost"]["rays"]
    assert passes[-1]["cpu_seconds"] == pytest.approx(done["cost"]["cpu_seconds"])
    assert math.isfinite(passes[-1]["error"]["estimate"])
