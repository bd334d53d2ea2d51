"""The published JSON Schema says what the reader does, and the documentation says what the schema does."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest

import scenes
from schemas.errors import SceneError
from schemas.json_schema import scene_json_schema
from schemas.reading import read_scene

SCENES = sorted(Path(scenes.__file__).parent.glob("*/*.json"))


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft202012Validator:
    jsonschema.Draft202012Validator.check_schema(scene_json_schema())
    return jsonschema.Draft202012Validator(scene_json_schema())


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_packaged_scenes_follow_the_schema(path: Path, validator: jsonschema.Draft202012Validator) -> None:
    validator.validate(json.loads(path.read_text()))
    assert read_scene(path.read_bytes())[1] == ()


def places(content: Any) -> Iterator[tuple[Any, Any]]:
    if isinstance(content, dict | list):
        for part, inner in list(content.items() if isinstance(content, dict) else enumerate(content)):
            yield content, part
            yield from places(inner)


@pytest.mark.parametrize("wrong", [None, True, "text", -1e31, [], {"a": 1}], ids=repr)
def test_reader_refuses_what_the_schema_refuses(
    scene: dict[str, Any], wrong: object, validator: jsonschema.Draft202012Validator
) -> None:
    refused = 0
    for holder, part in places(scene):
        before, holder[part] = holder[part], wrong
        if not validator.is_valid(scene):
            refused += 1
            with pytest.raises(SceneError):
                read_scene(json.dumps(scene))
        holder[part] = before
    assert refused > 100
