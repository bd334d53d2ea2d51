"""Calls that create no job: plans, traces, previews, JSON Schemas. Every pointer leads into the request."""

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import jsonschema_rs
import numpy as np
import pytest
from PIL import Image

import renderer
import scenes
from schemas.api.jobs import JobRequest
from schemas.api.request_pointers import in_request, in_scene
from schemas.json_schema import scene_json_schema
from schemas.pointers import Parts
from service.workers.planning import Pixels, outlined
from tests.service.sending import JSON, mistakes, problem_of, textured
from tests.service.support import scene, submit

SCENES = sorted((Path(str(scenes.__file__)).parent / "gallery").glob("*.json"))
ORIGINS = [[0.0, 2.0, 6.0], [0.0, 2.0, 6.0], [3.0, 5.0, 3.0]]
DIRECTIONS = [[0.0, -1.0, -5.0], [0.0, 1.0, 0.0], [0.0, -2.5, 0.0]]


def parts_of(pointer: str) -> Parts:
    return tuple(part.replace("~1", "/").replace("~0", "~") for part in pointer.split("/")[1:])


def at(document: Any, pointer: str) -> Any:
    """Resolve a pointer; KeyError or IndexError if it leads nowhere."""
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
def test_pointers_of_a_plan_lead_into_the_request(path: Path) -> None:
    body = {"scene": json.loads(path.read_text())}
    request = JobRequest.model_validate(body)
    described = renderer.compile_scene(
        renderer.load_scene(outlined(request.scene), assets=Pixels())
    ).describe()
    plan = in_request(described, request)
    found = list(pointers(plan.model_dump()))
    assert len(found) > 5
    for pointer in found:
        assert pointer.startswith("/scene/")
        at(body, pointer)
    assert set(pointers(in_scene(plan).model_dump())) <= set(pointers(described.model_dump()))


def test_pointers_of_all_answers_lead_into_the_request(api: httpx2.Client) -> None:
    document = scene(16, 16, samples=4, light_samples=4)
    del document["background"]
    body = {"scene": document, "quality": {"mode": "fixed", "antialiasing": {"pattern": "sobol"}}}
    job = submit(api, document, quality=body["quality"])
    answers = [
        api.post("/v1/plans", json=body),
        api.get(f"/v1/jobs/{job}/plan"),
        api.post("/v1/quotes", json=body),
        api.post(f"/v1/jobs/{job}/inspections", json={"x": 0, "y": 0}),
        api.post(f"/v1/jobs/{job}/inspections", json={"x": 8, "y": 8}),
    ]
    for answer in answers:
        assert answer.status_code == 200, answer.text
        for pointer in pointers(answer.json()):
            assert pointer.startswith(("/scene", "/quality"))
            at(body, pointer)
    assert answers[0].json()["stages"] == answers[1].json()["stages"]


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
def test_problem_found_after_reading_has_its_line_and_column(
    api: httpx2.Client, path: str, body: dict[str, Any], pointer: str
) -> None:
    text = json.dumps(body, indent=2)
    for mark in ("", "\ufeff"):
        answer = api.post(path, content=(mark + text).encode(), headers=JSON)
        found = {one["pointer"]: one for one in problem_of(answer, 422)["errors"]}[pointer]
        line, column = text.splitlines()[found["line"] - 1], found["column"] - 1
        assert line[column] == json.dumps(at(body, pointer))[0]
        assert line[:column].strip() == json.dumps(parts_of(pointer)[-1]) + ":"


def trace(client: httpx2.Client, **changes: Any) -> httpx2.Response:
    sent = {"scene": scene(), "origins": ORIGINS, "directions": DIRECTIONS}
    return client.post("/v1/traces", json=sent | changes)


def test_rays_hit_what_the_renderer_says(api: httpx2.Client) -> None:
    answer = trace(api).json()
    hits = renderer.trace(renderer.compile_scene(scene()), np.array(ORIGINS), np.array(DIRECTIONS))
    assert answer["shape"] == hits.shape.tolist() == [1, -1, 0]
    assert answer["primitive"] == hits.primitive.tolist()
    assert answer["visibility"] == hits.visibility.tolist()
    for name in ("t", "position", "normal", "uv"):
        assert answer[name][1] is None
        assert [answer[name][i] for i in (0, 2)] == [getattr(hits, name)[i].tolist() for i in (0, 2)]
    assert answer["t"][2] == 2.0
    nothing = trace(api, origins=[], directions=[]).json()
    assert nothing == {name: [] for name in nothing}


def test_rays_that_make_no_sense_are_pointed_at(api: httpx2.Client) -> None:
    wrong = [
        ({"directions": DIRECTIONS[:2]}, "/directions"),
        ({"origins": [[0, 0]] * 3}, "/origins/0"),
        ({"directions": [[0, 0, 0], *DIRECTIONS[1:]]}, "/directions/0"),
        ({"origins": [["1", 0, 0], *ORIGINS[1:]]}, "/origins/0/0"),
        ({"origins": [*ORIGINS[:2], [0, -1e200, 0]]}, "/origins/2/1"),
        ({"directions": [DIRECTIONS[0], [0, 1e-310, 0], DIRECTIONS[2]]}, "/directions/1"),
        ({"directions": [*DIRECTIONS[:2], [0, 0, 1e300]]}, "/directions/2"),
        ({"origins": [[0, 0, 0]] * 1001, "directions": [[0, 0, 1]] * 1001}, "/origins"),
    ]
    for changes, pointer in wrong:
        assert mistakes(trace(api, **changes))[0][0].startswith(pointer), pointer


def preview(client: httpx2.Client, document: dict[str, Any], **rest: Any) -> httpx2.Response:
    return client.post("/v1/previews", json={"scene": document} | rest)


def test_preview_keeps_the_proportions_and_leaves_no_job(api: httpx2.Client) -> None:
    before = [job["id"] for job in api.get("/v1/jobs").json()["jobs"]]
    cases = {
        "smaller": (scene(400, 200), 128, (128, 64)),
        "never larger": (scene(20, 10), 128, (20, 10)),
        "at least one pixel": (scene(10, 640), 64, (1, 64)),
        # The picture itself would take hours.
        "many samples": (scene(400, 400, samples=1024, light_samples=1024), 16, (16, 16)),
    }
    for name, (document, side, expected) in cases.items():
        answer = preview(api, document, side=side)
        assert (answer.status_code, answer.headers["Content-Type"]) == (200, "image/png"), answer.text
        shown = Image.open(io.BytesIO(answer.content))
        assert shown.size == expected, name
        assert len(shown.getcolors(1 << 20) or ()) > 1
    assert [job["id"] for job in api.get("/v1/jobs").json()["jobs"]] == before


def test_schemas_take_scenes_and_nothing_else(api: httpx2.Client) -> None:
    published = api.get("/v1/schemas/scene.json").json()
    assert published == scene_json_schema()
    schema = jsonschema_rs.validator_for(published)
    assert schema.is_valid(scene())
    assert not schema.is_valid(scene() | {"shapes": [{"type": "cube"}]})
    assert not schema.is_valid(scene() | {"unknown": 1})
    assert api.get("/v1/schemas/manifest.json").json()["properties"]
