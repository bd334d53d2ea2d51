"""All problems come at once, in the user's words, and tell nothing back."""

from __future__ import annotations

import json
import pickle
import re
from pathlib import Path
from typing import Any

import pytest

import schemas
from schemas.base import Closed
from schemas.errors import SceneError
from schemas.jobs import JobRequest
from schemas.problems import Problem
from schemas.reading import read_document, read_scene
from schemas.scene import Scene
from schemas.sentences import BUILT_IN, OTHERWISE, SENTENCES, say
from schemas.translation import nearest


def told(source: object, model: type[Closed] = Scene) -> list[Problem]:
    with pytest.raises(SceneError) as caught:
        read_document(json.dumps(source), model)
    return list(caught.value.errors)


def test_wrong_numbers_names_fields_and_types_are_told_together(scene: dict[str, Any]) -> None:
    scene["camera"]["vertical_fov"] = 180
    scene["shapes"][0]["material"] = "plan"
    scene["shapes"][1]["tangnt"] = scene["shapes"][1].pop("tangent")
    scene["lights"][0]["type"] = "rectangel"
    scene["sampling"]["antialiasing"]["pattern"] = "Uniform"
    found = {(problem.pointer, problem.code, problem.suggestion) for problem in told(scene)}
    assert found == {
        ("/camera/vertical_fov", "out_of_range", None),
        ("/shapes/0/material", "unknown_material", "plain"),
        ("/shapes/1", "missing_field", None),
        ("/shapes/1/tangnt", "unknown_field", "tangent"),
        ("/lights/0/type", "unknown_type", "rectangle"),
        ("/sampling/antialiasing/pattern", "not_a_choice", "uniform"),
    }


def test_problems_come_in_the_order_of_the_document(scene: dict[str, Any]) -> None:
    scene = dict(reversed(scene.items()))
    scene["camera"]["width"] = scene["display"]["exposure"] = scene["background"] = None
    assert [problem.pointer for problem in told(scene)] == [
        "/display/exposure",
        "/background",
        "/camera/width",
    ]


def test_the_first_50_problems_are_told_and_the_others_counted(scene: dict[str, Any]) -> None:
    scene["shapes"] = [{"type": "triangle", "vertices": [1, 2, 3], "material": "nowhere"}] * 100
    with pytest.raises(SceneError) as caught:
        read_scene(json.dumps(scene))
    assert len(caught.value.errors) == 50
    # Three corners of each triangle, and the one name.
    assert caught.value.more == 100 * 3 + 1 - 50
    assert "300 more" in str(caught.value)


def test_a_scene_inside_a_request_has_pointers_into_the_request(scene: dict[str, Any]) -> None:
    scene["camera"]["up"] = [0, 0, 0]
    scene["materials"]["plain"]["ambiant"] = 1
    scene["shapes"][4]["material"] = "nowhere"
    request = {"scene": scene, "quality": {"mode": "fixd"}}
    found = {(problem.pointer, problem.code, problem.suggestion) for problem in told(request, JobRequest)}
    assert found == {
        ("/scene/camera/up", "zero_vector", None),
        ("/scene/materials/plain/ambiant", "unknown_field", "ambient"),
        ("/scene/shapes/4/material", "unknown_material", None),
        ("/quality/mode", "unknown_mode", "fixed"),
    }


def test_warnings_inside_a_request_have_pointers_into_the_request(scene: dict[str, Any]) -> None:
    scene["lights"] = []
    text = json.dumps({"scene": scene}, indent=1)
    _, (warning,) = read_document(text, JobRequest)
    assert (warning.pointer, warning.code) == ("/scene/lights", "no_light")
    assert text.split("\n")[(warning.line or 0) - 1][(warning.column or 0) - 1 :].startswith("[]")


def test_a_parsed_document_has_pointers_but_no_lines(scene: dict[str, Any]) -> None:
    scene["camera"]["width"] = 0
    with pytest.raises(SceneError) as caught:
        read_scene(scene)
    (problem,) = caught.value.errors
    assert (problem.pointer, problem.line, problem.column) == ("/camera/width", None, None)


def test_keys_are_escaped_in_pointers(scene: dict[str, Any]) -> None:
    scene["materials"]["a/b~c"] = {"type": "phong"}
    pointers = [problem.pointer for problem in told(scene)]
    assert pointers == ["/materials/a~1b~0c"]


def test_what_the_user_wrote_is_not_repeated_in_sentences(scene: dict[str, Any]) -> None:
    markup = "<script>hunter2</script>"
    scene["name"] = {markup: markup}
    scene["camera"]["position"] = markup
    scene["camera"]["up"] = [markup, 0, 0]
    scene["shapes"][0]["material"] = markup
    scene["shapes"][1]["type"] = markup
    scene["sampling"]["light"]["pattern"] = markup
    scene["sampling"]["seed"] = markup
    problems = told(scene)
    assert len(problems) == 7
    assert "hunter2" not in json.dumps([problem.model_dump() for problem in problems])


def test_a_key_as_long_as_a_book_is_not_repeated(scene: dict[str, Any]) -> None:
    scene["camera"]["x" * 100_000] = 1
    (problem,) = told(scene)
    assert (problem.pointer, problem.code) == ("/camera", "unknown_field")
    assert len(problem.model_dump_json()) < 1000


def test_an_array_that_is_too_short_is_one_problem_with_both_lengths(scene: dict[str, Any]) -> None:
    scene["camera"]["position"] = [1]
    (problem,) = told(scene)
    assert (problem.pointer, problem.code) == ("/camera/position", "wrong_length")
    assert "1, where 3 are needed" in problem.detail


def test_an_array_with_a_wrong_entry_is_not_called_too_short(scene: dict[str, Any]) -> None:
    """Without the wrong one there would be two vertices and no triangle; but they are there."""
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, "0"]]
    scene["shapes"][0] = {"type": "mesh", "vertices": corners, "triangles": [[0, 1, -1]], "material": "plain"}
    found = [(problem.pointer, problem.code) for problem in told(scene)]
    assert found == [("/shapes/0/vertices/2/2", "not_a_number"), ("/shapes/0/triangles/0/2", "out_of_range")]


@pytest.mark.parametrize("wrong", [None, 3, "text", [], [[]]], ids=repr)
def test_a_thing_that_is_no_object_is_told_so(scene: dict[str, Any], wrong: object) -> None:
    scene["shapes"][2] = scene["camera"] = scene["materials"]["plain"] = wrong
    found = {(problem.pointer, problem.code) for problem in told(scene)}
    assert found == {
        ("/shapes/2", "not_an_object"),
        ("/camera", "not_an_object"),
        ("/materials/plain", "not_an_object"),
    }


def test_a_missing_type_is_told_with_the_choices(scene: dict[str, Any]) -> None:
    del scene["lights"][2]["type"]
    (problem,) = told(scene)
    assert (problem.pointer, problem.code) == ("/lights/2", "missing_field")
    assert "'point'" in problem.detail


def test_mixed_forms_of_a_rectangle_are_told_by_the_fuller_one(scene: dict[str, Any]) -> None:
    scene["shapes"][1]["edges"] = [[1, 0, 0], [0, 1, 0]]
    (problem,) = told(scene)
    assert (problem.pointer, problem.code) == ("/shapes/1/edges", "unknown_field")


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("colour", "color"),
        ("COLOR", "color"),
        ("difuse", "diffuse"),
        ("xyz", None),
        (3, None),
        ("c" * 65, None),
    ],
)
def test_a_suggestion_is_near_or_none(written: object, meant: str | None) -> None:
    assert nearest(written, ["color", "diffuse", "specular"]) == meant


def test_the_error_can_be_sent_between_processes(scene: dict[str, Any]) -> None:
    scene["camera"] = None
    with pytest.raises(SceneError) as caught:
        read_scene(scene)
    copy = pickle.loads(pickle.dumps(caught.value))  # noqa: S301 - its own bytes
    assert (copy.errors, copy.more) == (caught.value.errors, caught.value.more)


def test_every_sentence_belongs_to_an_error_that_pydantic_has() -> None:
    assert set(SENTENCES) <= BUILT_IN


def test_an_error_without_a_sentence_is_still_told_without_the_value() -> None:
    kind = min(BUILT_IN - set(SENTENCES))
    assert say(kind, "Input should be hunter2", {}) == OTHERWISE


def test_the_codes_of_this_package_are_not_names_of_pydantic_errors() -> None:
    sources = [path.read_text() for path in Path(schemas.__file__).parent.glob("*.py")]
    codes = {code for text in sources for code in re.findall(r'PydanticCustomError\(\s*"(\w+)"', text)}
    assert "no_length" in codes
    assert codes & BUILT_IN == {"int_type"}
