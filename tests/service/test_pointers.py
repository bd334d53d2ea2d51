"""Over HTTP every pointer and every line refers to the body that was posted."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest

import renderer
import scenes
from schemas.api.jobs import JobRequest
from schemas.api.request_pointers import in_request, in_scene
from schemas.limits import Limits
from schemas.pointers import Parts
from service.jobs.admission import Pixels, outlined
from tests.service.conftest import Start
from tests.service.support import TIMEOUT, scene, submit
from tests.service.test_bad_requests import JSON, problem_of

SCENES = sorted((Path(scenes.__file__).parent / "gallery").glob("*.json"))


def parts_of(pointer: str) -> Parts:
    return tuple(part.replace("~1", "/").replace("~0", "~") for part in pointer.split("/")[1:])


def at(document: Any, pointer: str) -> Any:
    """What a pointer leads to; KeyError or IndexError if that is nowhere."""
    for part in parts_of(pointer):
        document = document[int(part) if isinstance(document, list) else part]
    return document


def pointers(node: Any) -> Iterator[str]:
    """All pointers of an answer."""
    if isinstance(node, dict):
        yield from node.get("pointers", ())
        if "pointer" in node:
            yield node["pointer"]
        for value in node.values():
            yield from pointers(value)
    elif isinstance(node, list | tuple):
        for value in node:
            yield from pointers(value)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_every_pointer_of_a_plan_leads_to_something_that_the_request_has(path: Path) -> None:
    body = {"scene": json.loads(path.read_text())}
    request = JobRequest.model_validate(body)
    loaded = renderer.load_scene(outlined(request.scene), assets=Pixels())
    described = renderer.compile_scene(loaded).describe()
    plan = in_request(described, request)
    found = list(pointers(plan.model_dump()))
    assert len(found) > 5
    for pointer in found:
        assert pointer.startswith("/scene/")
        at(body, pointer)
    assert set(pointers(in_scene(plan).model_dump())) <= set(pointers(described.model_dump()))


def test_plans_quotes_and_inspections_point_into_the_request(client: httpx2.Client) -> None:
    document = scene(16, 16, samples=4, light_samples=4)
    del document["background"]
    body = {"scene": document, "quality": {"mode": "fixed", "antialiasing": {"pattern": "sobol"}}}
    job = submit(client, document, quality=body["quality"])
    answers = [
        client.post("/v1/plans", json=body),
        client.get(f"/v1/jobs/{job}/plan"),
        client.post("/v1/quotes", json=body, timeout=TIMEOUT),
        client.post(f"/v1/jobs/{job}/inspections", json={"x": 0, "y": 0}),
        client.post(f"/v1/jobs/{job}/inspections", json={"x": 8, "y": 8}),
    ]
    for answer in answers:
        assert answer.status_code == 200, answer.text
        for pointer in pointers(answer.json()):
            assert pointer.startswith(("/scene", "/quality"))
            at(body, pointer)
    assert answers[0].json()["stages"] == answers[1].json()["stages"]


def textured(asset: str) -> dict[str, Any]:
    document = scene(8, 8)
    document["textures"] = {"a/b": {"type": "image", "asset": asset}}
    document["materials"]["floor"] = {"type": "phong", "color_texture": "a/b"}
    return document


COSTLY = scene(1000, 900, samples=1024, light_samples=1024)
RAYS = {"origins": [[0, 0, 9]] * 2, "directions": [[0, 0, -1]]}
FOUND_LATER: dict[str, tuple[str, dict[str, Any], str]] = {
    "no such asset": ("/v1/jobs", {"scene": textured("sha256:" + "0" * 64)}, "/scene/textures/a~1b/asset"),
    "a file's name": ("/v1/quotes", {"scene": textured("wood.png")}, "/scene/textures/a~1b/asset"),
    "rays": ("/v1/traces", {"scene": scene(8, 8), **RAYS}, "/directions"),
    "cost": ("/v1/plans", {"labels": {}, "scene": COSTLY}, "/scene"),
    "pictures": ("/v1/comparisons", {"image": {}, "reference": {"job": "x"}}, "/image"),
}


@pytest.mark.parametrize(("path", "body", "pointer"), FOUND_LATER.values(), ids=FOUND_LATER)
@pytest.mark.parametrize("mark", ["", "\ufeff"], ids=["", "BOM"])
def test_a_problem_found_after_reading_has_its_line_and_column(
    client: httpx2.Client, path: str, body: dict[str, Any], pointer: str, mark: str
) -> None:
    text = json.dumps(body, indent=2)
    answer = client.post(path, content=(mark + text).encode(), headers=JSON)
    found = {one["pointer"]: one for one in problem_of(answer, 422)["errors"]}[pointer]
    value = at(body, pointer)
    start = text.splitlines()[found["line"] - 1][found["column"] - 1 :]
    assert start[0] == json.dumps(value)[0]
    key = text.splitlines()[found["line"] - 1][: found["column"] - 1].strip()
    assert key == json.dumps(parts_of(pointer)[-1]) + ":"


@pytest.mark.parametrize("path", ["/v1/jobs", "/v1/plans", "/v1/quotes", "/v1/traces"])
def test_a_scene_that_is_not_wrapped_gets_one_hint(client: httpx2.Client, path: str) -> None:
    document = scene() | {"shapes": [{"type": "cube"}], "quality": {"mode": "fixed"}}
    [found] = problem_of(client.post(path, json=document), 422)["errors"]
    assert (found["code"], found["pointer"], found["line"]) == ("bare_scene", "", 1)
    assert '{"scene": ' in found["detail"]


def test_a_request_where_a_scene_belongs_gets_one_hint() -> None:
    with pytest.raises(renderer.SceneError) as caught:
        renderer.load_scene({"scene": scene(), "quality": None})
    [found] = caught.value.errors
    assert (found.code, found.pointer) == ("wrong_file", "")
    assert "'scene'" in found.detail


def test_as_many_rays_are_traced_as_the_setting_allows(start: Start) -> None:
    most = 300
    limits = Limits(max_values=1000, max_body_bytes=20_000)
    server = start(workers=1, max_trace_rays=most, limits=limits)
    # The longest numbers that doubles have.
    rays = {
        "origins": [[-1.2345678901234567e-101] * 3] * most,
        "directions": [[-1.2345678901234567e101] * 3] * most,
    }
    with httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        answer = client.post("/v1/traces", json={"scene": scene(8, 8), **rays})
        assert answer.status_code == 200, answer.text
        assert len(answer.json()["t"]) == most
        more = {name: rows + rows[:1] for name, rows in rays.items()}
        [found] = problem_of(client.post("/v1/traces", json={"scene": scene(8, 8), **more}), 422)["errors"]
        assert (found["pointer"], found["code"]) == ("/origins", "too_many")
        # Others are held to the limits of scenes.
        problem_of(client.post("/v1/plans", json={"scene": scene(8, 8), **rays}), 413)


def test_a_job_links_to_everything_that_is_under_it(client: httpx2.Client) -> None:
    job = client.get(f"/v1/jobs/{submit(client, scene(8, 8), layers=['depth'])}").json()
    linked = {job["links"].pop("self"), *job["links"].pop("layers").values(), *job["links"].values()}
    paths = client.get("/openapi.json").json()["paths"]
    there = {path.format(job_id=job["id"], name="depth") for path in paths if "{job_id}" in path}
    assert linked == there
