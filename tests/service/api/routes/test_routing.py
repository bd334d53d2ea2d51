"""Rules for all addresses: HEAD beside GET, all methods in Allow, no unknown parameters."""

import httpx2
import pytest

from tests.service.sending import SMALL, problem_of


def addresses(client: httpx2.Client, job: str) -> dict[str, set[str]]:
    """Every address of the API, of a job and a layer that are there, with its documented methods."""
    paths = client.get("/openapi.json").json()["paths"]
    return {
        path.format(job_id=job, name="depth", sha256="0" * 64, key_id="0" * 12): {
            method.upper() for method in methods
        }
        for path, methods in paths.items()
    }


@pytest.mark.slow
def test_head_answers_like_get_without_a_body(client: httpx2.Client) -> None:
    sent = SMALL | {"layers": ["depth"]}
    job = client.post("/v1/jobs", json=sent, headers={"Prefer": "wait=30"}).json()["id"]
    got = [path for path, methods in addresses(client, job).items() if "GET" in methods]
    assert len(got) > 15
    for path in [*got, "/", "/openapi.json", "/docs", "/web/main.js"]:
        head, answer = client.head(path), client.get(path)
        assert (head.status_code, head.content) == (answer.status_code, b""), path
        assert head.headers["Content-Type"] == answer.headers["Content-Type"], path


@pytest.mark.parametrize("method", ["PATCH", "TRACE", "OPTIONS"])
def test_allow_names_all_methods_of_an_address(api: httpx2.Client, done: str, method: str) -> None:
    for path, methods in addresses(api, done).items():
        expected = methods | {"OPTIONS"} | ({"HEAD"} if "GET" in methods else set())
        answer = api.request(method, path)
        if method == "OPTIONS":
            assert (answer.status_code, answer.content) == (204, b"")
            assert "Content-Type" not in answer.headers
        else:
            problem_of(answer, 405)
        assert set(answer.headers["Allow"].split(", ")) == expected, path


def test_unknown_address_says_where_the_reference_is(api: httpx2.Client) -> None:
    for method, path in (("GET", "/v2/jobs"), ("OPTIONS", "/v1/nothing"), ("GET", "/redoc")):
        assert "/docs" in problem_of(api.request(method, path), 404)["detail"]


def test_query_parameter_that_an_address_has_not_is_refused(api: httpx2.Client, done: str) -> None:
    for path, methods in addresses(api, done).items():
        for method in methods - {"HEAD"}:
            found = problem_of(api.request(method, path, params={"lable": "a:b"}), 422)
            assert [one["code"] for one in found["errors"]] == ["unknown_parameter"], (method, path)
    [found] = problem_of(api.get("/v1/jobs", params={"lable": "a:b", "limit": 1}), 422)["errors"]
    assert found["suggestion"] == "label"
    assert "xxx" not in problem_of(api.get("/v1/jobs", params={"x" * 1000: "1"}), 422)["detail"]


def test_query_parameter_that_counts_once_is_refused_twice(api: httpx2.Client) -> None:
    [found] = problem_of(api.get("/v1/jobs?state=failed&state=queued"), 422)["errors"]
    assert found["code"] == "repeated_parameter"
    assert api.get("/v1/jobs?label=a:b&label=c:d").status_code == 200
