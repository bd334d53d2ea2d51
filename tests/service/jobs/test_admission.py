"""Requests that ask too much are refused before any work."""

from typing import Any

import httpx2
import pytest

from tests.service.sending import mistakes
from tests.service.support import scene

LARGE = {"antialiasing": {"pattern": "random", "samples": 2048}}
LIMITS: dict[str, tuple[dict[str, Any], str]] = {
    "pixels": ({"scene": scene(2000, 2000)}, "/scene/camera"),
    "samples": ({"scene": scene() | {"sampling": LARGE}}, "/scene/sampling/antialiasing/samples"),
    "quality": ({"scene": scene(), "quality": {"mode": "fixed"} | LARGE}, "/quality/antialiasing/samples"),
    "shapes": ({"scene": scene() | {"shapes": scene()["shapes"] * 60}}, "/scene/shapes"),
    "cost": ({"scene": scene(1000, 900, samples=1024, light_samples=1024)}, "/scene"),
}


@pytest.mark.parametrize(("request_body", "pointer"), LIMITS.values(), ids=LIMITS)
def test_request_beyond_a_limit_makes_no_job(
    api: httpx2.Client, request_body: dict[str, Any], pointer: str
) -> None:
    def newest() -> list[str]:
        return [job["id"] for job in api.get("/v1/jobs", params={"limit": 1}).json()["jobs"]]

    before = newest()
    for path in ("/v1/jobs", "/v1/plans"):
        assert mistakes(api.post(path, json=request_body))[0][0].startswith(pointer)
    assert newest() == before
