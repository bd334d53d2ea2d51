"""Manifests are read from YAML and JSON alike, and every mistake is reported with its place."""

from __future__ import annotations

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
    """What is wrong, by pointer."""
    data = text if isinstance(text, str) else json.dumps(text)
    with pytest.raises(SceneError) as caught:
        read_manifest(data.encode(), yaml=yaml)
    return {problem.pointer: problem for problem in caught.value.errors}


def test_a_manifest_in_yaml_is_read_with_its_defaults() -> None:
    read = read_manifest(YAML.encode(), yaml=True)
    camera, hits = read.tests
    assert isinstance(camera, ImageTest)
    assert isinstance(hits, RaysTest)
    assert (camera.points, camera.hidden, hits.hidden) == (10, False, True)
    assert camera.accept == Metric(by="metric", metric="ssim", full=0.9, zero=0.5)
    assert hits.rays == CameraRays(type="camera")
    assert read.deadline == 60


def test_yaml_and_json_of_the_same_manifest_are_the_same() -> None:
    read = read_manifest(YAML.encode(), yaml=True)
    text = json.dumps(read.model_dump(mode="json"))
    assert read_manifest(text.encode(), yaml=False) == read
    # JSON is YAML too.
    assert read_manifest(text.encode(), yaml=True) == read


def test_every_problem_of_a_yaml_file_has_its_line_and_column() -> None:
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


def test_a_fault_of_yaml_itself_is_reported_where_it_is() -> None:
    problem = problems("schema: penumbra/manifest/v1\ntitle: [a, b\ntests: []\n", yaml=True)[""]
    assert problem.code == "not_yaml"
    assert problem.line == 3


def test_plain_words_of_yaml_stay_text_unless_they_are_what_json_has_too() -> None:
    text = YAML.replace("Intersections", "no").replace("A ray tracer", "2026-11-21")
    read = read_manifest(text.encode(), yaml=True)
    assert read.tests[1].name == "no"
    assert read.title == "2026-11-21"
    quoted = problems(YAML.replace("points: 10", 'points: "10"'), yaml=True)
    assert quoted["/tests/0/points"].code == "not_a_number"


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
def test_yaml_holds_no_more_than_json_could(text: str, code: str | None) -> None:
    codes = {problem.code for problem in problems(text, yaml=True).values()}
    assert code is None or code in codes


def test_aliases_cannot_blow_a_short_text_up() -> None:
    lines = ["a0: &a0 [x]"] + [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 9)]
    assert problems("\n".join(lines), yaml=True)[""].code == "too_large"


@pytest.mark.parametrize("name", ["../a.png", "/a.png", "a/../../b.png", "a\\b.png", "C:/a.png", "a//b.png"])
def test_a_name_that_leads_out_of_its_folder_is_refused(name: str) -> None:
    found = problems(manifest(submitted={"file": name, "encoding": "srgb"}))
    assert found["/tests/0/submitted/file"].code == "outside"


@pytest.mark.parametrize("name", ["a b", "-a", "ä", "a/b", "a.b"])
def test_an_id_can_be_the_name_of_a_file(name: str) -> None:
    assert problems(manifest(id=name))["/tests/0/id"].code == "not_an_id"


def test_an_id_stands_once_whatever_else_is_wrong() -> None:
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
def test_thresholds_go_from_good_to_bad(accept: dict[str, Any], code: str) -> None:
    assert problems(manifest(accept=accept))["/tests/0/accept"].code == code


def test_an_encoding_is_never_left_to_be_guessed() -> None:
    assert problems(manifest(submitted={"file": "a.png"}))["/tests/0/submitted"].code == "missing_field"
    reference = {"type": "picture", "file": "a.png"}
    assert problems(manifest(reference=reference))["/tests/0/reference"].code == "missing_field"


def test_a_region_has_pixels() -> None:
    assert problems(manifest(region=[4, 4, 4, 8]))["/tests/0/region"].code == "empty_region"


def test_the_published_schema_takes_its_example_and_refuses_what_the_reader_refuses() -> None:
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


def test_every_object_of_the_schema_is_closed_and_every_field_is_described() -> None:
    described = manifest_json_schema()
    own = [described["$defs"][name] for name in ("ImageTest", "SceneTest", "RaysTest", "TimeTest", "Verdict")]
    for definition in [described, *own]:
        assert definition["additionalProperties"] is False
        for name, field in definition["properties"].items():
            assert "description" in field or name == "kind", (definition["title"], name)
    assert "schema" in described["properties"]


def test_a_mistake_is_charged_once_and_to_tests_of_submitted_pictures() -> None:
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


@pytest.mark.parametrize("charged", ["shadow", [7], [{"tests": 3, "mistakes": [None]}], {}])
def test_charges_that_are_none_are_reported_without_a_crash(charged: object) -> None:
    document = manifest() | {"charged_once": charged}
    assert all(pointer.startswith("/charged_once") for pointer in problems(document))
