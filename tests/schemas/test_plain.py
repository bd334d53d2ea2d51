"""Scenes made in Python hold arrays, iterators and models: they are read as the JSON that they stand for."""

from __future__ import annotations

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
from schemas.scene import Scene


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


def test_a_scene_of_numpy_is_the_scene_of_lists(scene: dict[str, Any]) -> None:
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
def test_what_gives_numbers_one_after_the_other_is_an_array(scene: dict[str, Any], color: Any) -> None:
    read, _ = read_scene(scene | {"ambient": color})
    assert len(read.ambient) == 3


def test_iterators_are_read_once(scene: dict[str, Any]) -> None:
    """Names are checked on the raw scene, and what has been read by then would be missing in the scene."""
    read, _ = read_scene(scene | {"shapes": iter(scene["shapes"])})
    assert len(read.shapes) == len(scene["shapes"])


def test_models_and_mappings_of_any_kind_are_objects(scene: dict[str, Any]) -> None:
    whole, _ = read_scene(scene)
    mixed = {
        name: getattr(whole, name) if name in {"camera", "lights"} else part for name, part in scene.items()
    }
    assert read_scene(MappingProxyType(mixed))[0] == whole
    assert json.loads(json.dumps(plain(whole, max_depth=64))) == json.loads(
        whole.model_dump_json(exclude_unset=True)
    )


def test_what_is_wrong_inside_an_array_has_its_own_pointer(scene: dict[str, Any]) -> None:
    vertices = np.array([[0, 0, 0], [1, np.nan, 0], [0, 1, np.inf]])
    scene["shapes"] = [{"type": "triangle", "vertices": vertices, "material": "plain"}]
    with pytest.raises(SceneError) as caught:
        read_scene(scene)
    found = {problem.pointer: problem.code for problem in caught.value.errors}
    assert found == {"/shapes/0/vertices/1/1": "not_finite", "/shapes/0/vertices/2/2": "not_finite"}


def test_all_that_json_has_no_word_for_is_named_in_its_place(scene: dict[str, Any]) -> None:
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


def test_a_document_that_contains_itself_twice_is_refused(scene: dict[str, Any]) -> None:
    scene["camera"] |= {"left": scene, "right": scene}
    with pytest.raises(SceneError) as caught:
        read_scene(scene)
    assert [problem.code for problem in caught.value.errors] == ["too_deep"]


@pytest.mark.parametrize("depth", [4, 5])
def test_documents_of_python_may_be_as_deep_as_those_of_text(depth: int) -> None:
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


def test_a_scene_is_not_changed_by_being_read(scene: dict[str, Any]) -> None:
    corner = np.zeros(3)
    scene["background"] = corner
    assert isinstance(read_scene(scene)[0], Scene)
    assert scene["background"] is corner
