"""Requests generated from the OpenAPI document: every answer is one that the document describes."""

from __future__ import annotations

import httpx2
import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, settings
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import content_type_conformance, status_code_conformance

from service.app import create_app
from service.server import RunningServer
from service.settings import Settings

EXAMPLES = 15
EVERYWHERE = {403: {"cross_site"}, 422: {"parameters", "not_usable"}}
"""Codes of every call, beside those of its own with the same status."""

schema = schemathesis.openapi.from_dict(create_app(Settings()).openapi())


@pytest.mark.slow
@schema.parametrize()
@settings(
    max_examples=EXAMPLES,
    derandomize=True,
    deadline=None,
    database=None,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=list(HealthCheck),
)
def test_no_request_breaks_the_service(case: schemathesis.Case, server: RunningServer) -> None:
    if "wait" in (case.query or {}):
        case.query["wait"] = 0
    answer = case.call(base_url=server.url)
    case.validate_response(
        answer, checks=[not_a_server_error, content_type_conformance, status_code_conformance]
    )
    assert answer.status_code < 400 or has_documented_code(case, answer)


def has_documented_code(case: schemathesis.Case, answer: schemathesis.Response) -> bool:
    """Whether a problem has a code that its call lists, or one of every call; 405 is that of no call."""
    reply = case.operation.definition.raw["responses"].get(str(answer.status_code))
    if reply is None or case.method == "HEAD":  # whose answers have no body
        return True
    codes = {*reply.get("x-codes", ()), *EVERYWHERE.get(answer.status_code, ())}
    return answer.json()["code"] in codes


def test_every_route_of_the_contract_is_documented(client: httpx2.Client) -> None:
    paths = client.get("/openapi.json").json()["paths"]
    documented = {f"{method.upper()} {path}" for path, methods in paths.items() for method in methods}
    assert documented >= {
        "POST /v1/jobs",
        "GET /v1/jobs",
        "GET /v1/jobs/{job_id}",
        "DELETE /v1/jobs/{job_id}",
        "POST /v1/jobs/{job_id}/cancel",
        "PUT /v1/jobs/{job_id}/pin",
        "DELETE /v1/jobs/{job_id}/pin",
        "POST /v1/prune",
        "GET /v1/jobs/{job_id}/tiles",
        "GET /v1/jobs/{job_id}/events",
        "GET /v1/jobs/{job_id}/image.png",
        "GET /v1/jobs/{job_id}/image.npy",
        "GET /v1/jobs/{job_id}/image.exr",
        "GET /v1/jobs/{job_id}/layers/{name}.npy",
        "GET /v1/jobs/{job_id}/plan",
        "GET /v1/jobs/{job_id}/convergence",
        "POST /v1/plans",
        "POST /v1/quotes",
        "POST /v1/comparisons",
        "POST /v1/traces",
        "PUT /v1/assets/{sha256}",
        "GET /v1/assets/{sha256}",
        "HEAD /v1/assets/{sha256}",
        "GET /v1/schemas/scene.json",
        "GET /v1/schemas/manifest.json",
        "GET /livez",
        "GET /readyz",
        "GET /version",
        "GET /metrics",
    }
