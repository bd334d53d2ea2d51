"""Rules for all addresses: HEAD beside GET, all methods in Allow, no unknown parameters."""

from __future__ import annotations

from typing import Any

import httpx2
import pytest

from tests.service.support import finish, scene, submit
from tests.service.test_bad_requests import problem_of

SHA256 = "0" * 64


@pytest.fixture(scope="module")
def job(server: Any) -> str:
    with httpx2.Client(base_url=server.url) as client:
        return finish(client, submit(client, scene(8, 8), layers=["depth"]))["id"]


def addresses(client: httpx2.Client, job: str) -> dict[str, set[str]]:
    """Every address of the API, of a job and a layer that are there, with its documented methods."""
    paths = client.get("/openapi.json").json()["paths"]
    return {
        path.format(job_id=job, name="depth", sha256=SHA256): {method.upper() for method in methods}
        for path, methods in paths.items()
    }


def test_head_answers_like_get_without_a_body_everywhere(client: httpx2.Client, job: str) -> None:
    found = addresses(client, job)
    got = [path for path, methods in found.items() if "GET" in methods]
    assert len(got) > 15
    for path in [*got, "/", "/openapi.json", "/docs", "/web/main.js"]:
        head, answer = client.head(path), client.get(path)
        assert (head.status_code, head.content) == (answer.status_code, b""), path
        assert head.headers["Content-Type"] == answer.headers["Content-Type"], path


@pytest.mark.parametrize("method", ["PATCH", "TRACE", "OPTIONS"])
def test_allow_names_all_methods_of_an_address(client: httpx2.Client, job: str, method: str) -> None:
    for path, methods in addresses(client, job).items():
        expected = methods | {"OPTIONS"} | ({"HEAD"} if "GET" in methods else set())
        answer = client.request(method, path)
        if method == "OPTIONS":
            assert (answer.status_code, answer.content) == (204, b"")
        else:
            problem_of(answer, 405)
        assert set(answer.headers["Allow"].split(", ")) == expected, path


def test_an_address_that_is_not_there_has_no_options(client: httpx2.Client) -> None:
    problem_of(client.options("/v1/nothing"), 404)


def test_head_of_the_events_of_a_running_job_does_not_wait_for_its_end(client: httpx2.Client) -> None:
    running = submit(client, scene(256, 256, samples=36, light_samples=64))
    answer = client.head(f"/v1/jobs/{running}/events")
    assert answer.headers["Content-Type"].startswith("text/event-stream")
    assert client.get(f"/v1/jobs/{running}").json()["state"] in ("queued", "running")
    client.delete(f"/v1/jobs/{running}")


def test_no_address_takes_a_query_parameter_that_it_does_not_have(client: httpx2.Client, job: str) -> None:
    for path, methods in addresses(client, job).items():
        for method in methods - {"HEAD"}:
            found = problem_of(client.request(method, path, params={"lable": "a:b"}), 422)
            assert "'lable'" in found["detail"], (method, path)
            assert [one["code"] for one in found["errors"]] == ["unknown_parameter"], (method, path)


def test_a_misspelt_query_parameter_gets_the_one_that_was_meant(client: httpx2.Client) -> None:
    [found] = problem_of(client.get("/v1/jobs", params={"lable": "a:b", "limit": 1}), 422)["errors"]
    assert found["suggestion"] == "label"


def test_a_query_parameter_that_counts_once_is_refused_twice(client: httpx2.Client) -> None:
    [found] = problem_of(client.get("/v1/jobs?state=failed&state=queued"), 422)["errors"]
    assert found["code"] == "repeated_parameter"
    assert client.get("/v1/jobs?label=a:b&label=c:d").status_code == 200


def test_a_query_parameter_with_a_long_name_is_not_repeated(client: httpx2.Client) -> None:
    found = problem_of(client.get("/v1/jobs", params={"x" * 1000: "1"}), 422)
    assert "xxx" not in found["detail"]


@pytest.mark.parametrize(
    ("accept", "binary"),
    [
        (["application/octet-stream"], True),
        (["APPLICATION/Octet-Stream"], True),
        (["text/html", "application/octet-stream"], True),
        (["application/octet-stream;q=0.2, application/json;q=0.1"], True),
        (["application/json;q=0, */*"], True),
        (["application/octet-stream;q=0"], False),
        (["application/json, application/octet-stream;q=0.1"], False),
        (["*/*"], False),
        ([], False),
    ],
    ids=str,
)
def test_tiles_come_in_the_preferred_form(
    client: httpx2.Client, job: str, accept: list[str], binary: bool
) -> None:
    headers = [("Accept", part) for part in accept] or {"Accept": ""}
    answer = client.get(f"/v1/jobs/{job}/tiles", headers=headers)
    assert (answer.headers["Content-Type"] == "application/octet-stream") is binary
    assert answer.headers["Vary"] == "Accept"


def test_headers_that_come_in_parts_are_read_as_one(client: httpx2.Client, job: str) -> None:
    path = f"/v1/jobs/{job}/image.npy"
    tag = client.get(path).headers["ETag"]
    parts = [("If-None-Match", '"other, too"'), ("If-None-Match", tag)]
    assert client.get(path, headers=parts).status_code == 304
    prefer = [("Prefer", "respond-async"), ("Prefer", 'wait="20"')]
    answer = client.post("/v1/jobs", json={"scene": scene(8, 8)}, headers=prefer)
    assert (answer.headers["Preference-Applied"], answer.json()["state"]) == ("wait=5", "succeeded")


def test_an_answer_without_a_body_names_no_type_of_it(client: httpx2.Client) -> None:
    doomed = submit(client, scene(8, 8))
    focus = client.post(f"/v1/jobs/{doomed}/focus", json={"x0": 0, "y0": 0, "x1": 8, "y1": 8})
    for answer in (focus, client.delete(f"/v1/jobs/{doomed}"), client.delete("/v1/session")):
        assert (answer.status_code, answer.content) == (204, b"")
        assert "Content-Type" not in answer.headers
