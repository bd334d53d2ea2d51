"""Jobs over HTTP: submitted, listed, repeated, limited in time, deleted."""

import json
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx2
import pytest

from tests.service.conftest import Start
from tests.service.sending import JSON, SMALL, mistakes, problem_of
from tests.service.support import API_ON_BOTH, TIMEOUT, ended, finish, job_of, long_scene, scene, submit, wait

LOWER_RIGHT = {"x0": 40, "y0": 40, "x1": 64, "y1": 64}
"""In tiles of 16 pixels, the four in that corner of a picture of 64 x 64."""


def post(client: httpx2.Client, request: dict[str, Any] = SMALL, **headers: str) -> httpx2.Response:
    return client.post("/v1/jobs", json=request, headers=headers)


def test_job_has_what_its_request_says(api: httpx2.Client) -> None:
    labels = {"course": "graphics", "student": "a: b"}
    answer = post(api, SMALL | {"labels": labels, "priority": -3})
    job = answer.json()
    assert (job["labels"], job["priority"], job["user"]) == (labels, -3, "local")
    assert answer.headers["Location"] == job["links"]["self"] == f"/v1/jobs/{job['id']}"
    assert job_of(api, job["id"])["labels"] == labels


def test_job_links_to_everything_that_is_under_it(api: httpx2.Client) -> None:
    job = job_of(api, submit(api, scene(8, 8), layers=["depth"]))
    linked = {job["links"].pop("self"), *job["links"].pop("layers").values(), *job["links"].values()}
    paths = api.get("/openapi.json").json()["paths"]
    assert linked == {path.format(job_id=job["id"], name="depth") for path in paths if "{job_id}" in path}


@API_ON_BOTH
def test_submission_may_wait_for_the_end(api: httpx2.Client) -> None:
    answer = post(api, {"scene": scene()}, Prefer="wait=5")
    assert answer.status_code == 202
    assert answer.headers["Preference-Applied"] == "wait=5"
    assert ended(answer.json())


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"labels": {"a b": "c"}}, "/labels/a b"),
        ({"labels": {"a/b": "c"}}, "/labels/a~1b"),
        ({"labels": {"": "c"}}, "/labels/"),
        ({"labels": {"x" * 64: "c"}}, "/labels/" + "x" * 64),
        ({"labels": {"a": 1}}, "/labels/a"),
        ({"labels": {f"n{number}": "" for number in range(17)}}, "/labels"),
        ({"labels": {"a": "x" * 201}}, "/labels/a"),
        ({"priority": 11}, "/priority"),
        ({"priority": 1.5}, "/priority"),
        ({"time_limit": 0}, "/time_limit"),
        ({"layers": "depth"}, "/layers"),
        ({"layers": [3]}, "/layers/0"),
        ({"layers": ["depth", "nromal"]}, "/layers/1"),
    ],
)
def test_field_out_of_bounds_is_pointed_at(api: httpx2.Client, change: dict[str, Any], place: str) -> None:
    assert [pointer for pointer, _ in mistakes(post(api, SMALL | change))] == [place]


@API_ON_BOTH
def test_list_is_filtered_by_label_and_state_and_comes_in_pages(api: httpx2.Client) -> None:
    sent = [
        post(api, SMALL | {"labels": {"found": "by:label", "number": str(number)}}, Prefer="wait=5").json()
        for number in range(5)
    ]
    newest = [job["id"] for job in sent][::-1]

    def found(**params: Any) -> list[str]:
        return [job["id"] for job in api.get("/v1/jobs", params=params).json()["jobs"]]

    assert found(limit=5) == newest
    assert found(label="found:by:label") == newest
    assert found(label=["found:by:label", "number:1"]) == [sent[1]["id"]]
    some = ["found:by:label", "number:1", "number:3", "number:7"]
    assert found(label=some) == found(label=some[::-1]) == [sent[3]["id"], sent[1]["id"]]
    assert found(label=some, limit=1) == [sent[3]["id"]]
    assert found(label=[*some, "found:otherwise"], state="succeeded") == [sent[3]["id"], sent[1]["id"]]
    assert found(label="found:by:label", state="succeeded") == newest
    assert found(label="found:by:label", state="cancelled") == []
    assert found(label="found:by") == []
    for label in ({}, {"label": "found:by:label"}):
        first = api.get("/v1/jobs", params={"limit": 2, **label}).json()
        rest = api.get("/v1/jobs", params={"limit": 3, "cursor": first["next"], **label}).json()
        assert [job["id"] for job in first["jobs"] + rest["jobs"]] == newest
    assert rest["next"] is None
    # No job can have it.
    assert api.get("/v1/jobs", params={"label": "found:\0"}).status_code in (200, 422)


@API_ON_BOTH
def test_list_is_searched_sorted_and_counted(api: httpx2.Client) -> None:
    names = ("Torus 50%", "torus_2", "cube", "a torus", "sphere")
    for number, name in enumerate(names):
        post(api, {"scene": scene(8, 8) | {"name": name}, "labels": {"hand-in": f"week {number} late"}})
    mine = {"search": "k ", "total": True}

    def found(**params: Any) -> list[str]:
        return [job["name"] for job in api.get("/v1/jobs", params=mine | params).json()["jobs"]]

    assert found(search="torus") == ["a torus", "torus_2", "Torus 50%"]
    assert found(search="%") == ["Torus 50%"]
    assert found(search="s_2") == ["torus_2"]
    assert found(search="IN:Week 2 ") == ["cube"]
    assert found(search="torus", label="hand-in:week 1 late") == ["torus_2"]
    assert found(search="torus", state="cancelled") == []
    assert found(sort="created") == list(names)
    by_name = sorted(names, key=str.lower)
    assert (found(sort="name"), found(sort="-name")) == (by_name, by_name[::-1])
    assert found(sort="user") == found()
    for sort, order in (("name", by_name), ("created", list(names)), ("-created", names[::-1])):
        first = api.get("/v1/jobs", params=mine | {"limit": 2, "sort": sort}).json()
        rest = api.get("/v1/jobs", params=mine | {"sort": sort, "cursor": first["next"]}).json()
        assert [job["name"] for job in first["jobs"] + rest["jobs"]] == list(order)
        assert (first["total"], rest["total"], rest["next"]) == (5, 5, None)
    assert api.get("/v1/jobs").json()["total"] is None


def test_list_refuses_a_parameter_that_means_nothing(api: httpx2.Client) -> None:
    cursors = [{"cursor": cursor} for cursor in ("0", "abc", "-3", "9" * 30)]
    labels = [{"label": label} for label in ("found", ":x", "two words:x", "a:" + "x" * 201)]
    others = [{"search": "x\0"}, {"search": "x" * 201}, {"sort": "state"}]
    for params in cursors + labels + others:
        assert problem_of(api.get("/v1/jobs", params=params), 422)["code"] == "parameters"


@API_ON_BOTH
def test_idempotency_key_gives_the_same_job(api: httpx2.Client) -> None:
    first, again = (post(api, **{"Idempotency-Key": "same"}) for _ in range(2))
    assert (first.status_code, again.status_code) == (202, 202)
    assert again.json()["id"] == first.json()["id"]
    assert again.headers["Location"] == first.headers["Location"]
    assert "Idempotency-Replayed" not in first.headers
    assert again.headers["Idempotency-Replayed"] == "true"
    assert post(api, **{"Idempotency-Key": "other"}).json()["id"] != first.json()["id"]
    # The same request, however its JSON is written.
    text = json.dumps(json.loads(json.dumps(SMALL), parse_int=float), indent=2, sort_keys=True)
    rewritten = api.post("/v1/jobs", content=text, headers=JSON | {"Idempotency-Key": "same"})
    assert rewritten.json()["id"] == first.json()["id"]
    reused = post(api, SMALL | {"priority": 1}, **{"Idempotency-Key": "same"})
    assert problem_of(reused, 422)["code"] == "idempotency_key_reused"


@API_ON_BOTH
def test_idempotency_key_sent_at_once_gives_one_job(api: httpx2.Client) -> None:
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda _: post(api, **{"Idempotency-Key": "at-once"}), range(8)))
    assert {answer.status_code for answer in answers} == {202}
    assert len({answer.json()["id"] for answer in answers}) == 1
    assert sum("Idempotency-Replayed" in answer.headers for answer in answers) == 7


@API_ON_BOTH
def test_time_limit_fails_a_job_that_is_not_finished(api: httpx2.Client) -> None:
    job = wait(api, submit(api, long_scene(), time_limit=0.2), ended)
    assert (job["state"], job["failure"]["code"]) == ("failed", "time_limit")
    assert job["failure"]["retryable"] is False


def test_time_limit_ends_target_quality_with_its_picture(api: httpx2.Client) -> None:
    quality = {"mode": "target", "error": 1e-5}
    job = finish(api, submit(api, scene(48, 48), quality=quality, time_limit=0.5))
    assert job["error"] is None or job["error"]["estimate"] > 1e-5


@API_ON_BOTH
def test_deleted_job_is_gone_with_all_it_made(api: httpx2.Client) -> None:
    job = submit(api, scene())
    finish(api, job)
    deleted = api.delete(f"/v1/jobs/{job}")
    assert (deleted.status_code, deleted.content, "Content-Type" in deleted.headers) == (204, b"", False)
    paths = ["", "/tiles", "/events", "/plan", "/log", "/request", "/image.png", "/image.npy"]
    assert {api.get(f"/v1/jobs/{job}{path}").status_code for path in paths} == {404}
    assert job not in [listed["id"] for listed in api.get("/v1/jobs").json()["jobs"]]


@pytest.mark.slow
def test_focus_renders_its_tiles_first_in_each_pass(start: Start) -> None:
    server = start(workers=1, tile_size=16)
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        busy = submit(client, long_scene())
        job = submit(client, scene(64, 64))
        answer = client.post(f"/v1/jobs/{job}/focus", json=LOWER_RIGHT)
        assert answer.status_code == 204, answer.text
        client.post(f"/v1/jobs/{busy}/cancel")
        finish(client, job)
        passes: dict[int, list[int]] = {}
        for event in client.get(f"/v1/jobs/{job}/tiles").json()["events"]:
            passes.setdefault(event["pass_index"], []).append(event["tile"])
        corner = [row * 4 + column for row in (2, 3) for column in (2, 3)]
        rest = [tile for tile in range(16) if tile not in corner]
        assert passes == {0: [0], 1: corner + rest, 2: corner + rest}


def test_focus_is_checked_and_changes_no_finished_job(api: httpx2.Client, done: str) -> None:
    wrong = [
        (LOWER_RIGHT | {"x1": 40}, ""),
        (LOWER_RIGHT | {"y0": -1}, "/y0"),
        (LOWER_RIGHT | {"x0": 1.5}, "/x0"),
        ({"x0": 0, "y0": 0, "x1": 1}, ""),
    ]
    for region, pointer in wrong:
        assert mistakes(api.post(f"/v1/jobs/{done}/focus", json=region))[0][0] == pointer
    assert api.post(f"/v1/jobs/{done}/focus", json=LOWER_RIGHT).status_code == 204
    problem_of(api.post("/v1/jobs/0123456789abcdef/focus", json=LOWER_RIGHT), 404)
