"""The request of a job can be read again."""

from __future__ import annotations

import json

import httpx2

from tests.service.support import finish, scene
from tests.service.test_bad_requests import problem_of


def test_a_request_comes_back_byte_for_byte(client: httpx2.Client) -> None:
    body = json.dumps({"scene": scene(16, 16, samples=1, light_samples=1)}, indent=3).encode()
    sent = client.post("/v1/jobs", content=body, headers={"Content-Type": "application/json"}).json()["id"]
    answer = client.get(f"/v1/jobs/{sent}/request")
    assert answer.headers["content-type"] == "application/json"
    assert answer.content == body
    finish(client, sent)


def test_an_unknown_job_has_no_request(client: httpx2.Client) -> None:
    problem_of(client.get("/v1/jobs/0123456789abcdef/request"), 404)
