"""Further fields of a job's request, and requests that are repeated."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx2
import pytest

from tests.service.conftest import Start
from tests.service.support import (
    ON_BOTH,
    TIMEOUT,
    ended,
    finish,
    job_of,
    long_scene,
    scene,
    submit,
    wait,
)
from tests.service.test_bad_requests import problem_of

SMALL = {"scene": scene(16, 16, samples=1, light_samples=1)}


def post(client: httpx2.Client, request: dict[str, Any], **headers: str) -> httpx2.Response:
    return client.post("/v1/jobs", json=request, headers=headers)


def test_a_job_has_the_labels_and_the_priority_of_its_request(client: httpx2.Client) -> None:
    labels = {"course": "graphics", "student": "a: b"}
    job = post(client, SMALL | {"labels": labels, "priority": -3}).json()
    assert (job["labels"], job["priority"], job["user"]) == (labels, -3, "local")
    assert job_of(client, job["id"])["labels"] == labels


@pytest.mark.parametrize(
    ("field", "value", "place"),
    [
        ("labels", {"a b": "c"}, "/labels/a b"),
        ("labels", {"a": 1}, "/labels/a"),
        ("labels", {f"n{number}": "" for number in range(17)}, "/labels"),
        ("labels", {"a": "x" * 201}, "/labels/a"),
        ("priority", 11, "/priority"),
        ("priority", 1.5, "/priority"),
        ("time_limit", 0, "/time_limit"),
    ],
)
def test_what_is_out_of_bounds_is_refused_with_its_place(
    client: httpx2.Client, field: str, value: Any, place: str
) -> None:
    answer = post(client, SMALL | {field: value})
    assert answer.status_code == 422
    assert [error["pointer"] for error in answer.json()["errors"]] == [place]


@ON_BOTH
def test_jobs_are_found_by_label_and_state(client: httpx2.Client) -> None:
    ids = []
    for number in range(3):
        labels = {"found": "by:label", "number": str(number)}
        ids.append(post(client, SMALL | {"labels": labels}, Prefer="wait=5").json()["id"])

    def found(**params: Any) -> list[str]:
        return [job["id"] for job in client.get("/v1/jobs", params=params).json()["jobs"]]

    assert found(label="found:by:label") == ids[::-1]
    assert found(label=["found:by:label", "number:1"]) == [ids[1]]
    assert found(label="found:by:label", state="succeeded") == ids[::-1]
    assert found(label="found:by:label", state="cancelled") == []
    assert found(label="found:by") == []


@ON_BOTH
def test_a_label_that_no_job_can_have_breaks_no_list(client: httpx2.Client) -> None:
    assert client.get("/v1/jobs", params={"label": "found:\0"}).status_code in (200, 422)


def test_a_list_by_label_has_pages(client: httpx2.Client) -> None:
    ids = [post(client, SMALL | {"labels": {"pages": "yes"}}).json()["id"] for _ in range(3)]
    first = client.get("/v1/jobs", params={"label": "pages:yes", "limit": 2}).json()
    rest = client.get("/v1/jobs", params={"label": "pages:yes", "limit": 2, "cursor": first["next"]}).json()
    assert [job["id"] for job in first["jobs"] + rest["jobs"]] == ids[::-1]
    assert rest["next"] is None


def test_a_label_that_names_no_value_is_no_filter(client: httpx2.Client) -> None:
    assert client.get("/v1/jobs", params={"label": "found"}).status_code == 422


@ON_BOTH
def test_the_same_key_gives_the_same_job(client: httpx2.Client) -> None:
    first = post(client, SMALL, **{"Idempotency-Key": "same"})
    again = post(client, SMALL, **{"Idempotency-Key": "same"})
    assert (first.status_code, again.status_code) == (202, 202)
    assert again.json()["id"] == first.json()["id"]
    assert again.headers["Location"] == first.headers["Location"]
    assert "Idempotency-Replayed" not in first.headers
    assert again.headers["Idempotency-Replayed"] == "true"
    other = post(client, SMALL, **{"Idempotency-Key": "other"})
    assert other.json()["id"] != first.json()["id"]


def test_a_key_is_refused_with_another_request_and_named(client: httpx2.Client) -> None:
    post(client, SMALL, **{"Idempotency-Key": "reused"})
    answer = post(client, SMALL | {"priority": 1}, **{"Idempotency-Key": "reused"})
    assert (answer.status_code, answer.json()["code"]) == (422, "idempotency_key_reused")
    assert "'reused'" in answer.json()["detail"]


def test_a_key_knows_its_request_however_its_json_is_written(client: httpx2.Client) -> None:
    first = post(client, SMALL, **{"Idempotency-Key": "written"})
    text = json.dumps(json.loads(json.dumps(SMALL), parse_int=float), indent=2, sort_keys=True)
    headers = {"Content-Type": "application/json", "Idempotency-Key": "written"}
    again = client.post("/v1/jobs", content=text, headers=headers)
    assert (again.status_code, again.json()["id"]) == (202, first.json()["id"])
    assert again.headers["Idempotency-Replayed"] == "true"


def test_a_request_that_was_refused_leaves_its_key_free(client: httpx2.Client) -> None:
    assert post(client, {"scene": {}}, **{"Idempotency-Key": "free"}).status_code == 422
    answer = post(client, SMALL, **{"Idempotency-Key": "free"})
    assert (answer.status_code, "Idempotency-Replayed" in answer.headers) == (202, False)


@ON_BOTH
def test_requests_with_one_key_at_the_same_time_give_one_job(client: httpx2.Client) -> None:
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda _: post(client, SMALL, **{"Idempotency-Key": "at-once"}), range(8)))
    assert {answer.status_code for answer in answers} == {202}
    assert len({answer.json()["id"] for answer in answers}) == 1
    assert sum("Idempotency-Replayed" in answer.headers for answer in answers) == 7


@pytest.mark.slow
def test_a_key_is_known_after_a_restart(start: Start) -> None:
    jobs = []
    for _ in range(2):
        server = start(workers=1)
        with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
            jobs.append(post(client, SMALL, **{"Idempotency-Key": "kept"}).json()["id"])
        server.stop()
    assert jobs[0] == jobs[1]


@ON_BOTH
def test_a_job_that_is_not_finished_in_time_fails_and_says_so(client: httpx2.Client) -> None:
    job = wait(client, submit(client, long_scene(), time_limit=0.2), ended)
    assert (job["state"], job["failure"]["code"]) == ("failed", "time_limit")
    assert job["failure"]["retryable"] is False
    assert "0.2 seconds" in job["failure"]["message"]


def test_a_limit_of_time_ends_target_quality_with_its_picture(client: httpx2.Client) -> None:
    quality = {"mode": "target", "error": 1e-5}
    job = finish(client, submit(client, scene(48, 48), quality=quality, time_limit=0.5))
    assert job["error"] is None or job["error"]["estimate"] > 1e-5


@pytest.mark.slow
def test_a_picture_is_kept_as_long_as_the_service_says_and_its_job_as_long_again(start: Start) -> None:
    keep = 3.0
    server = start(workers=1, keep_seconds=keep)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        job = post(client, SMALL, Prefer="wait=30").json()
        assert job["state"] == "succeeded"
        assert job["expires_at"] > job["finished_at"]
        folder = server.data / "jobs" / job["id"]
        assert folder.exists()
        params = {"after": job["last_seq"], "wait": 0}
        while (found := client.get(f"/v1/jobs/{job['id']}")).json().get("state") == "succeeded":
            client.get(f"/v1/jobs/{job['id']}/tiles", params=params)
        assert (found.json()["state"], found.json()["progress"]) == ("expired", job["progress"])
        assert client.get(f"/v1/jobs/{job['id']}/image.npy").status_code == 410
        while client.get(f"/v1/jobs/{job['id']}").status_code == 200:
            pass
        assert not folder.exists()
        assert client.get("/v1/jobs").json()["jobs"] == []


@pytest.mark.parametrize("name", ["", "-first", "two words", "a/b", "ä", "x" * 64, "a\n"])
def test_what_the_name_of_a_label_may_be_is_said_where_it_is_wrong(client: httpx2.Client, name: str) -> None:
    (error,) = problem_of(post(client, SMALL | {"labels": {name: "x"}}), 422)["errors"]
    assert "1 to 63 characters" in error["detail"]
    assert error["pointer"] == "/labels/" + name.replace("/", "~1")


def test_how_many_and_how_long_labels_may_be_is_said(client: httpx2.Client) -> None:
    (error,) = problem_of(post(client, SMALL | {"labels": {f"a{n}": "" for n in range(17)}}), 422)["errors"]
    assert "at most 16" in error["detail"]
    (error,) = problem_of(post(client, SMALL | {"labels": {"a": "x" * 201}}), 422)["errors"]
    assert "200 characters" in error["detail"]


@pytest.mark.parametrize("key", ["", "two words", "x" * 256, "tab\there"])
def test_what_an_idempotency_key_may_be_is_said(client: httpx2.Client, key: str) -> None:
    (error,) = problem_of(post(client, SMALL, **{"Idempotency-Key": key}), 422)["errors"]
    assert error["code"] == "idempotency_key"
    assert "1 to 255 characters" in error["detail"]


@pytest.mark.parametrize("label", ["found", ":x", "two words:x", "a:" + "x" * 201])
def test_what_a_label_to_look_for_may_be_is_said(client: httpx2.Client, label: str) -> None:
    (error,) = problem_of(client.get("/v1/jobs", params={"label": label}), 422)["errors"]
    assert error["code"] == "label"
    assert "name:value" in error["detail"]
