"""Scenes made in Python hold arrays, iterators and models: they are read as the JSON that they stand for."""

import json
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from schemas.errors import SceneError
from schemas.limits import Limits
from schemas.reading import read_scene
from schemas.reading.plain import plain


def of_numpy(value: Any) -> Any:
    """The same document with an array for each list of numbers, and NumPy's numbers for all others."""
    match value:
        case dict():
            return {np.str_(key): of_numpy(member) for key, member in value.items()}
        case list() if value and all(isinstance(entry, int | float | list) for entry in value):
            return np.array(value)
        case list():
            return tuple(map(of_numpy, value))
        case bool():
            return np.bool_(value)
        case int():
            return np.int64(value)
        case float():
            return np.float32(value) if float(np.float32(value)) == value else np.float64(value)
        case _:
            return value


def test_numpy_scene_equals_lists(scene: dict[str, Any]) -> None:
    scene["shapes"].append(
        {
            "type": "mesh",
            "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
            "triangles": [[0, 1, 2]],
            "scale": 2,
            "smooth": True,
            "material": "plain",
        }
    )
    assert read_scene(of_numpy(scene)) == read_scene(scene)


@pytest.mark.parametrize(
    "color",
    [
        np.ones(6)[::2],
        np.broadcast_to(np.float16(1), 3),
        range(1, 4),
        (1.0 for _ in range(3)),
        map(float, "123"),
        {"r": 1, "g": 2, "b": 3}.values(),
    ],
    ids=["every other", "read-only", "a range", "a generator", "a map", "a view"],
)
def test_iterables_are_arrays(scene: dict[str, Any], color: Any) -> None:
    read, _ = read_scene(scene | {"ambient": color})
    assert len(read.ambient) == 3


def test_models_and_mappings_are_objects(scene: dict[str, Any]) -> None:
    whole, _ = read_scene(scene)
    mixed = {
        name: getattr(whole, name) if name in {"camera", "lights"} else part for name, part in scene.items()
    }
    assert read_scene(MappingProxyType(mixed))[0] == whole
    assert json.loads(json.dumps(plain(whole, max_depth=64))) == json.loads(
        whole.model_dump_json(exclude_unset=True)
    )


def test_value_without_json_form_is_named(scene: dict[str, Any]) -> None:
    strange: dict[str, Any] = {"ambient": {0.5, 1.0}, "background": b"123", "name": Path("a"), "version": 1j}
    strange["sampling"] = {"seed": Decimal(3), 7: 8}
    with pytest.raises(SceneError) as caught:
        read_scene(scene | strange)
    found = {problem.pointer: problem.detail.split(".")[0] for problem in caught.value.errors}
    assert found == {
        "/ambient": "JSON has no set",
        "/background": "JSON has no bytes",
        "/name": f"JSON has no {type(Path()).__name__}",
        "/version": "JSON has no complex",
        "/sampling/seed": "JSON has no Decimal",
        "/sampling": "The name of a field must be text",
    }


def test_document_that_contains_itself(scene: dict[str, Any]) -> None:
    scene["camera"] |= {"left": scene, "right": scene}
    with pytest.raises(SceneError) as caught:
        read_scene(scene)
    assert [problem.code for problem in caught.value.errors] == ["too_deep"]


@pytest.mark.parametrize("depth", [4, 5])
def test_depth_of_python_documents(depth: int) -> None:
    deep: Any = 1
    for _ in range(depth):
        deep = [deep]
    document: Mapping[str, Any] = {"a": deep}
    codes = []
    for source in (document, json.dumps(document)):
        with pytest.raises(SceneError) as caught:
            read_scene(source, limits=Limits(max_depth=5))
        codes.append({problem.code for problem in caught.value.errors} == {"too_deep"})
    assert codes == [depth == 5] * 2
