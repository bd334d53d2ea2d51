"""All problems come at once, in the user's words, and repeat no values."""

from __future__ import annotations

import json
import pickle
import re
from pathlib import Path
from typing import Any

import pytest

import schemas
from schemas.api.jobs import JobRequest
from schemas.base import Closed
from schemas.errors import BUILT_IN, Problem, SceneError
from schemas.reading import read_document, read_scene
from schemas.reading.translation import OTHERWISE, SENTENCES, nearest, say
from schemas.scene import Scene


def problems_of(source: object, model: type[Closed] = Scene) -> list[Problem]:
    with pytest.raises(SceneError) as caught:
        read_document(json.dumps(source), model)
    return list(caught.value.errors)


def test_wrong_numbers_names_fields_and_types_are_reported_together(scene: dict[str, Any]) -> None:
    scene["camera"]["vertical_fov"] = 180
    scene["shapes"][0]["material"] = "plan"
    scene["shapes"][1]["tangnt"] = scene["shapes"][1].pop("tangent")
    scene["lights"][0]["type"] = "rectangel"
    scene["sampling"]["antialiasing"]["pattern"] = "Uniform"
    found = {(problem.pointer, problem.code, problem.suggestion) for problem in problems_of(scene)}
    assert found == {
        ("/camera/vertical_fov", "out_of_range", None),
        ("/shapes/0/material", "unknown_material", "plain"),
        ("/shapes/1/tangnt", "unknown_field", "tangent"),
        ("/lights/0/type", "unknown_type", "rectangle"),
        ("/sampling/antialiasing/pattern", "not_a_choice", "uniform"),
    }


def test_problems_come_in_the_order_of_the_document(scene: dict[str, Any]) -> None:
    scene = dict(reversed(scene.items()))
    scene["camera"]["width"] = scene["display"]["exposure"] = scene["background"] = None
    assert [problem.pointer for problem in problems_of(scene)] == [
        "/display/exposure",
        "/background",
        "/camera/width",
    ]


def test_the_first_50_problems_are_listed_and_the_others_counted(scene: dict[str, Any]) -> None:
    scene["shapes"] = [{"type": "triangle", "vertices": [1, 2, 3], "material": "nowhere"}] * 100
    with pytest.raises(SceneError) as caught:
        read_scene(json.dumps(scene))
    assert len(caught.value.errors) == 50
    assert caught.value.more == 101 - 50
    assert "100 more" in str(caught.value)


def test_a_scene_inside_a_request_has_pointers_into_the_request(scene: dict[str, Any]) -> None:
    scene["camera"]["up"] = [0, 0, 0]
    scene["materials"]["plain"]["ambiant"] = 1
    scene["shapes"][4]["material"] = "nowhere"
    request = {"scene": scene, "quality": {"mode": "fixd"}}
    found = {
        (problem.pointer, problem.code, problem.suggestion) for problem in problems_of(request, JobRequest)
    }
    assert found == {
        ("/scene/camera/up", "zero_vector", None),
        ("/scene/materials/plain/ambiant", "unknown_field", "ambient"),
        ("/scene/shapes/4/material", "unknown_material", None),
        ("/quality/mode", "unknown_mode", "fixed"),
    }


@pytest.mark.parametrize(
    ("quality", "mode"), [({}, "fixed"), ({"light": {"samples": 4}}, "fixed"), ({"error": 0.1}, "target")]
)
def test_a_quality_without_a_mode_is_of_the_mode_that_its_fields_belong_to(
    scene: dict[str, Any], quality: dict[str, Any], mode: str
) -> None:
    request, _ = read_document({"scene": scene, "quality": quality}, JobRequest)
    assert request.quality is not None
    assert request.quality.mode == mode


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
    pointers = [problem.pointer for problem in problems_of(scene)]
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
    problems = problems_of(scene)
    assert len(problems) == 7
    assert "hunter2" not in json.dumps([problem.model_dump() for problem in problems])


def test_a_key_as_long_as_a_book_is_not_repeated(scene: dict[str, Any]) -> None:
    scene["camera"]["x" * 100_000] = 1
    (problem,) = problems_of(scene)
    assert (problem.pointer, problem.code) == ("/camera", "unknown_field")
    assert len(problem.model_dump_json()) < 1000


def test_an_array_that_is_too_short_is_one_problem_with_both_lengths(scene: dict[str, Any]) -> None:
    scene["camera"]["position"] = [1]
    (problem,) = problems_of(scene)
    assert (problem.pointer, problem.code) == ("/camera/position", "wrong_length")
    assert "1 entry, where 3 are needed" in problem.detail


def test_an_array_with_a_wrong_entry_is_not_called_too_short(scene: dict[str, Any]) -> None:
    """Without the wrong one there would be two vertices and no triangle; but they are there."""
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, "0"]]
    scene["shapes"][0] = {"type": "mesh", "vertices": corners, "triangles": [[0, 1, -1]], "material": "plain"}
    found = [(problem.pointer, problem.code) for problem in problems_of(scene)]
    assert found == [("/shapes/0/vertices/2/2", "not_a_number"), ("/shapes/0/triangles/0/2", "out_of_range")]


@pytest.mark.parametrize("wrong", [None, 3, "text", [], [[]]], ids=repr)
def test_what_is_not_an_object_is_reported_as_such(scene: dict[str, Any], wrong: object) -> None:
    scene["shapes"][2] = scene["camera"] = scene["materials"]["plain"] = wrong
    found = {(problem.pointer, problem.code) for problem in problems_of(scene)}
    assert found == {
        ("/shapes/2", "not_an_object"),
        ("/camera", "not_an_object"),
        ("/materials/plain", "not_an_object"),
    }


def test_a_missing_type_is_reported_with_the_choices(scene: dict[str, Any]) -> None:
    del scene["lights"][2]["type"]
    (problem,) = problems_of(scene)
    assert (problem.pointer, problem.code) == ("/lights/2", "missing_field")
    assert "'point'" in problem.detail


def test_mixed_forms_of_a_rectangle_are_reported_by_the_fuller_one(scene: dict[str, Any]) -> None:
    scene["shapes"][1]["edges"] = [[1, 0, 0], [0, 1, 0]]
    (problem,) = problems_of(scene)
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


def test_an_error_without_a_sentence_is_still_reported_without_the_value() -> None:
    kind = min(BUILT_IN - set(SENTENCES))
    assert say(kind, "Input should be hunter2", {}) == OTHERWISE


def test_the_codes_of_this_package_are_not_names_of_pydantic_errors() -> None:
    sources = [path.read_text() for path in Path(schemas.__file__).parent.glob("*.py")]
    codes = {code for text in sources for code in re.findall(r'PydanticCustomError\(\s*"(\w+)"', text)}
    assert "no_length" in codes
    assert codes & BUILT_IN == set()


def one(source: object, model: type[Closed] = Scene) -> tuple[str, str, str | None]:
    (problem,) = problems_of(source, model)
    return problem.pointer, problem.detail, problem.suggestion


@pytest.mark.parametrize(
    ("place", "written", "meant"),
    [
        ("/camera", "Position", "position"),
        ("/camera", "lookAt", "look_at"),
        ("/shapes/1", "tangnt", "tangent"),
        ("/shapes/2", "edge", "edges"),
        ("/shapes/3", "axis", "axes"),
        ("/shapes/4", "Radius", "radius"),
        ("/shapes/5", "Asset", "asset"),
        ("/lights/1", "corners", "corner"),
        ("/textures/wood", "asse", "asset"),
        ("", "camra", "camera"),
        ("", "material", "materials"),
        ("", "texures", "textures"),
    ],
)
def test_a_misspelt_field_is_one_mistake(scene: dict[str, Any], place: str, written: str, meant: str) -> None:
    scene["shapes"].append({"type": "mesh", "asset": "m.obj", "material": "plain"})
    holder: Any = scene
    for part in place.split("/")[1:]:
        holder = holder[int(part) if isinstance(holder, list) else part]
    holder[written] = holder.pop(meant)
    pointer, detail, suggestion = one(scene)
    assert (pointer, suggestion) == (f"{place}/{written}", meant)
    assert detail.startswith("There is no such field here.")


@pytest.mark.parametrize("document", [[], 3, "x", None, {}, {"camera": 1}], ids=repr)
def test_a_document_without_fields_is_refused(document: object) -> None:
    for model in (Scene, JobRequest):
        assert problems_of(document, model)[0].pointer in ("", "/camera")


def test_a_misspelt_field_does_not_hide_another_one_that_is_missing(scene: dict[str, Any]) -> None:
    del scene["shapes"][1]["size"]
    scene["shapes"][1]["tangnt"] = scene["shapes"][1].pop("tangent")
    found = {(problem.pointer, problem.code) for problem in problems_of(scene)}
    assert found == {("/shapes/1/tangnt", "unknown_field"), ("/shapes/1", "missing_field")}


@pytest.mark.parametrize(
    ("shape", "offer"),
    [
        ({"type": "rectangle"}, "'center', 'normal', 'tangent' and 'size', or 'corner' and 'edges'"),
        ({"type": "ellipsoid", "center": [0, 0, 0]}, "'axes', or 'radius'"),
        ({"type": "mesh", "smooth": True}, "'vertices' and 'triangles', or 'asset'"),
    ],
    ids=["rectangle", "ellipsoid", "mesh"],
)
def test_a_shape_without_a_form_is_one_mistake_with_all_forms(
    scene: dict[str, Any], shape: dict[str, Any], offer: str
) -> None:
    scene["shapes"][0] = shape | {"material": "plain"}
    assert one(scene) == ("/shapes/0", f"Fields are missing: add {offer}.", None)


def test_a_field_of_another_form_is_reported_with_both_forms(scene: dict[str, Any]) -> None:
    scene["shapes"][3]["radius"] = 1
    pointer, detail, suggestion = one(scene)
    assert (pointer, suggestion) == ("/shapes/3/radius", None)
    assert detail == "Give 'radius', or 'axes', but not both."
    del scene["shapes"][3]["radius"]
    scene["shapes"][2] |= {"center": [0, 0, 0], "normal": [0, 0, 1]}
    pointer, detail, _ = one(scene)
    assert pointer == "/shapes/2/center"
    assert detail == "Give 'center', 'normal', 'tangent' and 'size', or 'corner' and 'edges', but not both."
    scene["shapes"][2] = {"type": "mesh", "asset": "m.obj", "uvs": [], "material": "plain"}
    assert one(scene)[1] == "This field goes with 'vertices' and 'triangles', not with 'asset'. Remove it."


def test_a_name_that_is_not_defined_is_one_mistake_however_often_it_is_used(scene: dict[str, Any]) -> None:
    for shape in scene["shapes"]:
        shape["material"] = "gold"
    del scene["materials"]["carved"]
    pointer, detail, _ = one(scene)
    assert pointer == "/shapes/0/material"
    assert detail.endswith("or define it there. 4 other places name it too.")


@pytest.mark.parametrize("name", ["", "x" * 201], ids=["empty", "long"])
def test_a_name_that_cannot_be_one_is_not_called_undefined_as_well(scene: dict[str, Any], name: str) -> None:
    scene["shapes"][0]["material"] = name
    assert [problem.code for problem in problems_of(scene)] == ["wrong_length"]


def test_the_same_mistake_in_many_entries_of_an_array_is_one(scene: dict[str, Any]) -> None:
    scene["camera"]["position"] = ["0", "2", "8"]
    pointer, detail, _ = one(scene)
    assert pointer == "/camera/position/0"
    assert detail.endswith("without quotes. The same is true of 2 more entries of this array.")


def test_different_mistakes_in_an_array_stay_apart(scene: dict[str, Any]) -> None:
    scene["camera"]["position"] = ["0", 1e300, 8]
    assert [problem.code for problem in problems_of(scene)] == ["not_a_number", "out_of_range"]
    request = {"scene": scene, "layers": ["dept", "normals"]}
    scene["camera"]["position"] = [0, 2, 8]
    assert [problem.suggestion for problem in problems_of(request, JobRequest)] == ["depth", "normal"]


def test_a_mesh_without_vertices_is_one_mistake(scene: dict[str, Any]) -> None:
    scene["shapes"][0] = {"type": "mesh", "vertices": [], "triangles": [[0, 1, 2]], "material": "plain"}
    pointer, detail, _ = one(scene)
    assert (pointer, detail) == ("/shapes/0/vertices", "This has 0 entries; at least 3 are needed.")


@pytest.mark.parametrize(
    ("place", "value", "sentence"),
    [
        ("/camera/position/0", 1e16, "This must be at most 1e15."),
        ("/camera/position/0", -1e16, "This must be at least -1e15."),
        ("/camera/focal_length", 0, "This must be more than 0: 1e-100 or more."),
        ("/camera/focal_length", -1, "This must be more than 0: 1e-100 or more."),
        ("/camera/vertical_fov", 0, "This must be more than 0."),
        ("/camera/vertical_fov", 180, "This must be less than 180."),
        ("/camera/width", 65537, "This must be at most 65536."),
        ("/ambient/0", -0.5, "This must be at least 0."),
        ("/ambient/0", 2e30, "This must be at most 1e30."),
        ("/sampling/seed", 1 << 53, "This must be at most 9007199254740991."),
        ("/name", "", "This text must not be empty."),
    ],
)
def test_bounds_are_written_as_people_write_them(
    scene: dict[str, Any], place: str, value: object, sentence: str
) -> None:
    *parents, last = place.split("/")[1:]
    holder: Any = scene
    for part in parents:
        holder = holder[part]
    holder[int(last) if isinstance(holder, list) else last] = value
    assert one(scene)[1] == sentence


def test_a_misspelt_pattern_is_one_mistake_though_the_samples_depend_on_it(scene: dict[str, Any]) -> None:
    scene["sampling"]["antialiasing"] = {"patern": "sobol", "samples": 5}
    assert one(scene)[0::2] == ("/sampling/antialiasing/patern", "pattern")


@pytest.mark.parametrize("code", ["#ff0000", "#F00", "#ff0000ff"])
def test_a_colour_as_a_code_is_refused_with_the_form_of_a_colour(scene: dict[str, Any], code: str) -> None:
    scene["materials"]["plain"]["color"] = code
    pointer, detail, _ = one(scene)
    assert pointer == "/materials/plain/color"
    assert detail.startswith("A colour is an array of three linear numbers: [1, 0, 0] is red.")


def test_a_sphere_is_an_ellipsoid(scene: dict[str, Any]) -> None:
    scene["shapes"][4]["type"] = "sphere"
    assert one(scene)[0::2] == ("/shapes/4/type", "ellipsoid")
