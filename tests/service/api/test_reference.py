"""The OpenAPI document, and the reference at /docs that is written from it."""

import httpx2
import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, settings
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import content_type_conformance, status_code_conformance

from schemas.api.plans import Convergence, Quote
from service.app import create_app
from service.server import RunningServer
from service.settings import Settings

EVERYWHERE = {403: {"cross_site"}, 422: {"parameters", "not_usable"}}
"""Codes of every call, beside those of its own with the same status."""
CONTRACT = """
GET POST /v1/jobs; GET DELETE /v1/jobs/{job_id}; POST /v1/jobs/{job_id}/cancel; POST /v1/prune
PUT DELETE /v1/jobs/{job_id}/pin; GET /v1/jobs/{job_id}/tiles; GET /v1/jobs/{job_id}/events
GET /v1/jobs/{job_id}/image.png; GET /v1/jobs/{job_id}/image.npy; GET /v1/jobs/{job_id}/image.exr
GET /v1/jobs/{job_id}/layers/{name}.npy; GET /v1/jobs/{job_id}/plan
GET /v1/jobs/{job_id}/convergence; POST /v1/plans; POST /v1/quotes
POST /v1/traces; POST /v1/comparisons; GET HEAD PUT /v1/assets/{sha256}; GET /v1/schemas/scene.json
GET /livez; GET /readyz; GET /version; GET /metrics
"""

document = create_app(Settings()).openapi()
# Requests are drawn here; tests of the schemas draw scenes, which takes minutes from a JSON Schema.
document["components"]["schemas"]["Scene"] = {"type": "object"}
# Its scene would be in nearly every request drawn, and dozens would be quoted: it is sent once, below.
del document["paths"]["/v1/quotes"]["post"]["requestBody"]["content"]["application/json"]["example"]
schema = schemathesis.openapi.from_dict(document)


@pytest.mark.slow
@schema.parametrize()
@settings(
    max_examples=1,
    derandomize=True,
    deadline=None,
    database=None,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=list(HealthCheck),
)
def test_answers_are_those_that_the_document_describes(
    case: schemathesis.Case, server: RunningServer
) -> None:
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


def calls(client: httpx2.Client) -> dict[str, set[str]]:
    """Methods of each documented address."""
    document = client.get("/openapi.json")
    same = {"If-None-Match": document.headers["ETag"]}
    assert client.get("/openapi.json", headers=same).status_code == 304
    paths = document.json()["paths"]
    return {path: {method.upper() for method in methods} for path, methods in paths.items()}


def test_routes_of_the_contract_are_documented(api: httpx2.Client) -> None:
    documented = calls(api)
    for line in CONTRACT.strip().replace("\n", "; ").split("; "):
        *methods, path = line.split()
        assert set(methods) <= documented[path], path


def test_examples_of_the_document_are_sent_and_answered(api: httpx2.Client) -> None:
    paths = api.get("/openapi.json").json()["paths"]
    quote = paths["/v1/quotes"]["post"]
    example = quote["requestBody"]["content"]["application/json"]["example"]
    assert Quote.model_validate(quote["responses"]["200"]["content"]["application/json"]["example"]).offers
    answer = api.post("/v1/quotes", json=example)
    assert answer.status_code == 200, answer.text
    assert Quote.model_validate(answer.json()).workers == 2
    convergence = paths["/v1/jobs/{job_id}/convergence"]["get"]["responses"]["200"]["content"]
    assert Convergence.model_validate(convergence["application/json"]["example"]).order
    assert set(convergence) == {"application/json", "text/csv", "image/svg+xml", "image/png"}
