"""All problems come at once, in the user's words, and repeat no values."""

import json
import pickle
import subprocess
import sys
from typing import Any

import pytest

from schemas.api.jobs import JobRequest
from schemas.base import Closed
from schemas.errors import Problem, SceneError
from schemas.reading import read_document, read_scene
from schemas.reading.translation import nearest
from schemas.scene import Scene


def problems_of(source: object, model: type[Closed] = Scene) -> list[Problem]:
    with pytest.raises(SceneError) as caught:
        read_document(json.dumps(source), model)
    return list(caught.value.errors)


IN_LITTLE_MEMORY = """
import resource, sys
from schemas.reading import SceneError, read_scene
resource.setrlimit(resource.RLIMIT_AS, (600 << 20,) * 2)
try:
    read_scene(sys.stdin.buffer.read())
except SceneError as error:
    print(len(error.errors), error.more > 0, error.errors[0].suggestion)
"""


def test_thousands_of_wrong_names_among_thousands_take_little_memory(scene: dict[str, Any]) -> None:
    plain, ball = scene["materials"]["plain"], {"type": "ellipsoid", "center": [0, 0, 0], "radius": 1}
    scene["materials"] |= {f"metal {number}": plain for number in range(9_000)}
    scene["shapes"] = [ball | {"material": f"metall {number}"} for number in range(20_000)]
    command = [sys.executable, "-c", IN_LITTLE_MEMORY]
    read = subprocess.run(command, input=json.dumps(scene).encode(), capture_output=True, check=False)
    assert read.stdout.decode().split(maxsplit=2) == ["50", "True", "metal 0\n"], read.stderr.decode()


def test_problems_are_reported_together(scene: dict[str, Any]) -> None:
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


def test_problems_are_cut_at_50(scene: dict[str, Any]) -> None:
    scene["shapes"] = [{"type": "triangle", "vertices": [1, 2, 3], "material": "nowhere"}] * 100
    with pytest.raises(SceneError) as caught:
        read_scene(json.dumps(scene))
    assert len(caught.value.errors) == 50
    assert caught.value.more == 101 - 50
    assert "100 more" in str(caught.value)


def test_pointers_into_a_request(scene: dict[str, Any]) -> None:
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


def test_keys_are_escaped_in_pointers(scene: dict[str, Any]) -> None:
    scene["materials"]["a/b~c"] = {"type": "phong"}
    pointers = [problem.pointer for problem in problems_of(scene)]
    assert pointers == ["/materials/a~1b~0c"]


def test_input_is_not_echoed(scene: dict[str, Any]) -> None:
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
def test_suggestion_is_near_or_none(written: object, meant: str | None) -> None:
    assert nearest(written, ["color", "diffuse", "specular"]) == meant


def test_error_is_pickled(scene: dict[str, Any]) -> None:
    scene["camera"] = None
    with pytest.raises(SceneError) as caught:
        read_scene(scene)
    copy = pickle.loads(pickle.dumps(caught.value))  # noqa: S301 - its own bytes
    assert (copy.errors, copy.more) == (caught.value.errors, caught.value.more)


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
def test_misspelt_field_has_a_suggestion(scene: dict[str, Any], place: str, written: str, meant: str) -> None:
    scene["shapes"].append({"type": "mesh", "asset": "m.obj", "material": "plain"})
    holder: Any = scene
    for part in place.split("/")[1:]:
        holder = holder[int(part) if isinstance(holder, list) else part]
    holder[written] = holder.pop(meant)
    pointer, detail, suggestion = one(scene)
    assert (pointer, suggestion) == (f"{place}/{written}", meant)
    assert detail == "There is no such field here."


def test_unknown_field_names_those_of_all_forms(scene: dict[str, Any]) -> None:
    scene["shapes"][3]["weight"] = 1
    assert one(scene)[1].endswith("The fields are 'type', 'center', 'axes', 'material', 'name', 'radius'.")


def test_misspelt_field_hides_no_missing_one(scene: dict[str, Any]) -> None:
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
def test_shape_without_a_form(scene: dict[str, Any], shape: dict[str, Any], offer: str) -> None:
    scene["shapes"][0] = shape | {"material": "plain"}
    assert one(scene) == ("/shapes/0", f"Fields are missing: add {offer}.", None)


def test_field_of_another_form(scene: dict[str, Any]) -> None:
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


def test_undefined_name_is_one_mistake(scene: dict[str, Any]) -> None:
    for shape in scene["shapes"]:
        shape["material"] = "gold"
    del scene["materials"]["carved"]
    pointer, detail, _ = one(scene)
    assert pointer == "/shapes/0/material"
    assert detail.endswith("or define it there. 4 other places name it too.")


def test_same_mistake_in_an_array_is_one(scene: dict[str, Any]) -> None:
    scene["camera"]["position"] = ["0", "2", "8"]
    pointer, detail, _ = one(scene)
    assert pointer == "/camera/position/0"
    assert detail.endswith("without quotes. The same is true of 2 more entries of this array.")


def test_sphere_suggests_ellipsoid(scene: dict[str, Any]) -> None:
    scene["shapes"][4]["type"] = "sphere"
    assert one(scene)[0::2] == ("/shapes/4/type", "ellipsoid")


@pytest.mark.parametrize(
    ("quality", "mode"), [({}, "fixed"), ({"light": {"samples": 4}}, "fixed"), ({"error": 0.1}, "target")]
)
def test_quality_without_a_mode(scene: dict[str, Any], quality: dict[str, Any], mode: str) -> None:
    request, _ = read_document({"scene": scene, "quality": quality}, JobRequest)
    assert request.quality is not None
    assert request.quality.mode == mode


def test_short_array_is_one_problem(scene: dict[str, Any]) -> None:
    scene["camera"]["position"] = [1]
    (problem,) = problems_of(scene)
    assert (problem.pointer, problem.code) == ("/camera/position", "wrong_length")
    assert "1 entry, where 3 are needed" in problem.detail


def test_missing_type_lists_the_choices(scene: dict[str, Any]) -> None:
    del scene["lights"][2]["type"]
    (problem,) = problems_of(scene)
    assert (problem.pointer, problem.code) == ("/lights/2", "missing_field")
    assert "'point'" in problem.detail
