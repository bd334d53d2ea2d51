"""A whole number may have a decimal point: neither JSON nor anything here distinguishes 32.0 from 32."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

import scenes
from schemas.api.administration import PruneRequest
from schemas.api.comparisons import ComparisonRequest
from schemas.api.inspections import InspectionRequest, TraceRequest
from schemas.api.jobs import JobRequest, Region
from schemas.api.plans import QuoteRequest
from schemas.errors import SceneError
from schemas.grading.manifests import BallRays, CameraRays, Manifest
from schemas.reading import read_document, read_scene
from service.converting.course import CourseDocument
from service.jobs.canonical import spec_of

SCENES = sorted(Path(scenes.__file__).parent.glob("*/*.json"))


def with_points(document: Any) -> Any:
    """The same document with every number written with a point."""
    return json.loads(json.dumps(document), parse_int=float)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scene_with_decimal_points(path: Path) -> None:
    document = json.loads(path.read_text())
    pointed = with_points(document)
    assert json.dumps(pointed) != json.dumps(document)
    assert read_scene(json.dumps(pointed))[0] == read_scene(pointed)[0] == read_scene(document)[0]


def test_request_with_decimal_points_is_shared() -> None:
    scene = json.loads(next(path for path in SCENES if path.stem == "basic").read_text())
    quality = {"mode": "fixed", "antialiasing": {"pattern": "sobol", "samples": 8}, "light": {"samples": 4}}
    document = {"scene": scene, "quality": quality, "priority": 3}
    request, _ = read_document(json.dumps(document).encode(), JobRequest)
    pointed, _ = read_document(json.dumps(with_points(document)).encode(), JobRequest)
    assert pointed == request
    assert spec_of(pointed) == spec_of(request)


OTHERS: list[tuple[type[BaseModel], dict[str, Any]]] = [
    (Region, {"x0": 0, "y0": 0, "x1": 64, "y1": 32}),
    (InspectionRequest, {"x": 20, "y": 30}),
    (PruneRequest, {"max_stored_bytes": 10_000_000_000}),
    (CameraRays, {"type": "camera", "width": 8, "height": 4}),
    (BallRays, {"type": "ball", "center": [0, 0, 0], "distance": 1, "radius": 1, "count": 10, "seed": 2}),
]


MODELS = (JobRequest, QuoteRequest, TraceRequest, ComparisonRequest, Manifest, CourseDocument)


@pytest.mark.parametrize("model", [*MODELS, *(model for model, _ in OTHERS)])
def test_every_integer_takes_a_decimal_point(model: type[BaseModel]) -> None:
    assert list(strict_integers(model.__pydantic_core_schema__)) == []


def strict_integers(schema: Any, *, whole: bool = False) -> Any:
    """Find integers of a core schema without the function before them that reads 32.0 as 32."""
    if isinstance(schema, dict):
        if schema.get("type") == "int" and not whole:
            yield schema
        before = schema.get("type") == "function-before"
        for name, part in schema.items():
            if name != "serialization":
                yield from strict_integers(part, whole=before and name == "schema")
    elif isinstance(schema, list | tuple):
        for part in schema:
            yield from strict_integers(part)


@pytest.mark.parametrize("wrong", [True, "32", 32.5, float("inf"), float("nan"), None, [32]], ids=repr)
def test_value_that_is_no_whole_number(scene: dict[str, Any], wrong: object) -> None:
    scene["camera"]["width"] = wrong
    with pytest.raises(SceneError) as caught:
        read_scene(scene)
    assert [(found.pointer, found.code) for found in caught.value.errors] == [("/camera/width", "not_whole")]


NUMPY = [np.int8, np.int32, np.int64, np.uint8, np.uint64, np.intp]


@pytest.mark.parametrize("kind", NUMPY, ids=lambda kind: kind.__name__)
def test_numpy_integers(scene: dict[str, Any], kind: type[np.integer[Any]]) -> None:
    scene["version"] = kind(1)
    scene["camera"] |= {"width": kind(32), "height": kind(16)}
    scene["sampling"] = {"antialiasing": {"samples": kind(9)}, "light": {"samples": kind(4)}, "seed": kind(7)}
    scene["shapes"].append(
        {
            "type": "mesh",
            "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
            "triangles": [[kind(0), kind(1), kind(2)]],
            "material": "plain",
        }
    )
    read, _ = read_scene(scene)
    numbers = [read.version, read.camera.width, read.sampling.seed, read.sampling.light.samples]
    assert numbers == [1, 32, 7, 4]
    assert {type(number) for number in numbers} == {int}
    assert json.loads(read.model_dump_json())["camera"]["width"] == 32


@pytest.mark.parametrize("wrong", [True, np.True_, np.int64(0), np.int64(-1), np.float64(1.5), "1"], ids=repr)
def test_boolean_is_no_whole_number(scene: dict[str, Any], wrong: object) -> None:
    scene["camera"]["width"] = wrong
    with pytest.raises(SceneError) as caught:
        read_scene(scene)
    assert [problem.pointer for problem in caught.value.errors] == ["/camera/width"]
