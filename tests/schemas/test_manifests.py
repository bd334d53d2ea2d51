"""Manifests are read from YAML and JSON alike, and every mistake is reported with its place."""

import copy
import json
import textwrap
from typing import Any

import jsonschema
import pytest

from schemas.errors import Problem, SceneError
from schemas.grading.acceptance import Metric
from schemas.grading.manifest_reading import manifest_json_schema, read_manifest
from schemas.grading.manifests import CameraRays, ImageTest, Manifest, RaysTest

YAML = textwrap.dedent("""\
    # What people write.
    schema: penumbra/manifest/v1
    title: A ray tracer
    tests:
      - id: camera
        name: Rays from the camera
        kind: image
        points: 10
        submitted: {file: pictures/camera.png, encoding: srgb}
        reference: {type: scene, file: camera.json}
        accept: {by: metric, metric: ssim, full: 0.9, zero: 0.5}
      - id: hits
        name: Intersections
        kind: rays
        points: 30
        hidden: true
        submitted: {type: hits, file: hits.npz}
        reference: camera.json
    """)


def manifest(**changes: Any) -> dict[str, Any]:
    """An example as an object, its first test changed."""
    document: dict[str, Any] = copy.deepcopy(manifest_json_schema()["examples"][0])
    document["tests"][0] |= changes
    return document


def problems(text: str | dict[str, Any], *, yaml: bool = False) -> dict[str, Problem]:
    """Problems by pointer."""
    data = text if isinstance(text, str) else json.dumps(text)
    with pytest.raises(SceneError) as caught:
        read_manifest(data.encode(), yaml=yaml)
    return {problem.pointer: problem for problem in caught.value.errors}


def test_defaults() -> None:
    read = read_manifest(YAML.encode(), yaml=True)
    camera, hits = read.tests
    assert isinstance(camera, ImageTest)
    assert isinstance(hits, RaysTest)
    assert (camera.points, camera.hidden, hits.hidden) == (10, False, True)
    assert camera.accept == Metric(by="metric", metric="ssim", full=0.9, zero=0.5)
    assert hits.rays == CameraRays(type="camera")
    assert read.deadline == 60


def test_yaml_and_json_are_the_same() -> None:
    read = read_manifest(YAML.encode(), yaml=True)
    text = json.dumps(read.model_dump(mode="json"))
    assert read_manifest(text.encode(), yaml=False) == read
    # JSON is YAML too.
    assert read_manifest(text.encode(), yaml=True) == read


def test_yaml_problems_have_their_lines() -> None:
    wrong = YAML.replace("points: 10", "points: -1").replace("encoding: srgb", "encoding: sRGB")
    wrong = wrong.replace("hidden: true", "hiden: true")
    found = problems(wrong, yaml=True)
    places = {pointer: (problem.line, problem.column) for pointer, problem in found.items()}
    assert places == {
        "/tests/0/points": (8, 13),
        "/tests/0/submitted/encoding": (9, 54),
        "/tests/1/hiden": (16, 5),
    }
    assert found["/tests/0/submitted/encoding"].suggestion == "srgb"
    assert found["/tests/1/hiden"].suggestion == "hidden"


def test_yaml_syntax_error_has_its_line() -> None:
    problem = problems("schema: penumbra/manifest/v1\ntitle: [a, b\ntests: []\n", yaml=True)[""]
    assert problem.code == "not_yaml"
    assert problem.line == 3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "empty"),
        ("title: !!python/object:os.system {}", "tagged"),
        ("a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\n" + "d: [*c]\n", None),
        ("a: &a [*a]", "too_deep"),
        ("[" * 5000, "too_deep"),
        ("? [a, b]\n: c", "not_text"),
        ("title: \x07", "not_yaml"),
        ("title: a\ntitle: b", "duplicate_field"),
    ],
    ids=["empty", "tag", "alias", "endless", "nested", "key", "control", "twice"],
)
def test_yaml_beyond_json_is_refused(text: str, code: str | None) -> None:
    codes = {problem.code for problem in problems(text, yaml=True).values()}
    assert code is None or code in codes


def test_yaml_aliases_are_refused() -> None:
    lines = ["a0: &a0 [x]"] + [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 9)]
    assert problems("\n".join(lines), yaml=True)[""].code == "too_large"


@pytest.mark.parametrize("name", ["../a.png", "/a.png", "a/../../b.png", "a\\b.png", "C:/a.png", "a//b.png"])
def test_file_outside_the_folder_is_refused(name: str) -> None:
    found = problems(manifest(submitted={"file": name, "encoding": "srgb"}))
    assert found["/tests/0/submitted/file"].code == "outside"


@pytest.mark.parametrize("name", ["a b", "-a", "ä", "a/b", "a.b"])
def test_invalid_id(name: str) -> None:
    assert problems(manifest(id=name))["/tests/0/id"].code == "not_an_id"


def test_repeated_id() -> None:
    found = problems(manifest(id="Rays", points=-1))
    assert found["/tests/1/id"].code == "id_twice"
    assert found["/tests/0/points"].code == "out_of_range"


@pytest.mark.parametrize(
    ("accept", "code"),
    [
        ({"by": "metric", "metric": "rmse", "full": 0.1, "zero": 0.1}, "not_in_order"),
        ({"by": "metric", "metric": "ssim", "full": 0.5, "zero": 0.9}, "not_in_order"),
        ({"by": "error", "full": 0.1, "bands": [{"at": 0.05, "share": 0.5}]}, "not_in_order"),
        (
            {"by": "error", "full": 0.1, "bands": [{"at": 0.2, "share": 0.3}, {"at": 0.3, "share": 0.5}]},
            "not_in_order",
        ),
        ({"by": "error", "full": 0.1, "zero": 0.3, "bands": [{"at": 0.2, "share": 0.5}]}, "two_scales"),
    ],
)
def test_thresholds_are_ordered(accept: dict[str, Any], code: str) -> None:
    assert problems(manifest(accept=accept))["/tests/0/accept"].code == code


def test_empty_region() -> None:
    assert problems(manifest(region=[4, 4, 4, 8]))["/tests/0/region"].code == "empty_region"


def test_json_schema_agrees_with_the_reader() -> None:
    validator = jsonschema.Draft202012Validator(manifest_json_schema())
    validator.check_schema(manifest_json_schema())
    validator.validate(manifest())
    assert isinstance(read_manifest(json.dumps(manifest()).encode(), yaml=False), Manifest)
    for wrong in (
        {"points": -1},
        {"kind": "picture"},
        {"submitted": {"file": "a.png"}},
        {"regio": [0, 0, 1, 1]},
    ):
        assert not validator.is_valid(manifest(**wrong))
        assert problems(manifest(**wrong))


def test_charged_once_names_picture_tests() -> None:
    document = manifest()
    document["charged_once"] = [
        {"mistakes": ["encoding", "offset"], "tests": ["shadow"]},
        {"mistakes": ["ambient", "encoding"], "tests": ["rays", "shadow", "shade"]},
        {"mistakes": ["colour"], "tests": []},
    ]
    found = problems(document)
    assert {pointer: problem.code for pointer, problem in found.items()} == {
        "/charged_once/1/mistakes/1": "charged_twice",
        "/charged_once/1/tests/0": "unknown_test",
        "/charged_once/1/tests/2": "unknown_test",
        "/charged_once/2/mistakes/0": "not_a_choice",
        "/charged_once/2/tests": "wrong_length",
    }


def test_required_tests_come_before() -> None:
    document = manifest()
    del document["charged_once"]
    test = document["tests"][0]
    document["tests"] = [
        test | {"id": "first", "requires": ["second"]},
        test | {"id": "second", "requires": ["first", "second", "third"]},
    ]
    assert {pointer: problem.code for pointer, problem in problems(document).items()} == {
        "/tests/0/requires/0": "unknown_test",
        "/tests/1/requires/1": "unknown_test",
        "/tests/1/requires/2": "unknown_test",
    }


def test_scenes_that_differ_are_rendered_for_each_student() -> None:
    stored = {"type": "picture", "file": "soft.png", "encoding": "srgb", "scene": "scenes/soft.json"}
    ranges = {"scenes": ["scenes/soft.json"], "secret": "autumn 2026", "turn": 5, "colors": 0.1}
    read_manifest(json.dumps(manifest() | {"per_student": ranges}).encode(), yaml=False)
    for document in (manifest(reference=stored), manifest(reference={"type": "scene", "file": "other.json"})):
        found = problems(document | {"per_student": ranges})
        assert found["/per_student/scenes/0"].code == "not_rendered"
