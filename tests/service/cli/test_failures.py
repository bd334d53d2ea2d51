"""Exit codes, and what is on stdout and stderr, whatever goes wrong."""

import inspect
import json
import shlex
from pathlib import Path
from typing import Any

import pytest

from service.cli import errors as cli_errors
from service.cli.errors import ExitCode
from service.cli.failures import OUTCOMES, report
from service.client import errors as client_errors
from tests.service.cli.conftest import Penumbra

NOWHERE = "--server http://127.0.0.1:9"
FAILURES = {
    ExitCode.USAGE: [
        "frobnicate",
        "ls --frobnicate",
        "render -o a.png",
        "render scene.json",
        "render scene.json -o a.jpg",
        "render scene.json -o .png",
        "render scene.json -o ''",
        "render scene.json -o missing/a.png",
        "render scene.json -o /proc/a.png",
        f"get some-id -o folder.png {NOWHERE}",
        "trace scene.json rays.npz -o hits.npy",
        "render scene.json -o a.png --samples 0",
        "render scene.json -o a.png --pattern spiral",
        "render scene.json -o a.png --samples 5 --pattern uniform",
        "explain scene.json --light-samples 5",
        "render scene.json -o a.png --workers 100000000",
        "render scene.json -o a.png --seed 9007199254740992",
        "render scene.json -o - --json",
        f"delete some-id '' {NOWHERE}",
        "compare job: a.png",
        f"submit scene.json -o - --layers depth {NOWHERE}",
        f"submit scene.json --timeout 3 {NOWHERE}",
    ],
    ExitCode.UNUSABLE_INPUT: [
        "render missing.json -o a.png",
        "explain folder.png",
        "render broken.json -o a.png",
        "validate scene.json empty.json",
        "explain -",
        "explain ''",
        "trace scene.json missing.npz -o hits.npz",
        "render textured.json -o a.png",
        f"submit broken.json {NOWHERE}",
        f"submit textured.json {NOWHERE}",
    ],
    ExitCode.SERVER: ["ls --server somewhere"],
}
CASES = [(code, words) for code, table in FAILURES.items() for words in table]


@pytest.fixture(autouse=True)
def files(tmp_path: Path, scene_file: Path, scene: dict[str, Any]) -> None:
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "empty.json").touch()
    (tmp_path / "broken.json").write_text('{"version": 1,\n "camera": }')
    textured = {
        "textures": {"wood": {"type": "image", "asset": "wood.png"}},
        "materials": scene["materials"] | {"floor": {"type": "phong", "color_texture": "wood"}},
    }
    (tmp_path / "textured.json").write_text(json.dumps(scene | textured))


@pytest.mark.parametrize(("code", "words"), CASES, ids=str)
def test_failure_leaves_no_file(here: Penumbra, tmp_path: Path, code: ExitCode, words: str) -> None:
    before = sorted(tmp_path.rglob("*"))
    for outcome in (here(*shlex.split(words)), here(*shlex.split(words), "--json")):
        assert outcome.code == code
        assert "Traceback" not in outcome.out + outcome.err
    assert "{" not in outcome.err
    if not words.startswith("validate"):
        assert outcome.document["title"]
        assert outcome.document["exit_code"] == code
    assert sorted(tmp_path.rglob("*")) == before


def test_every_exception_has_an_exit_code() -> None:
    known = tuple(kind for kind, _, _ in OUTCOMES)
    raised = [
        kind
        for module in (cli_errors, client_errors)
        for _, kind in inspect.getmembers(module, inspect.isclass)
        if issubclass(kind, Exception) and kind.__module__ == module.__name__
    ]
    assert [kind.__name__ for kind in raised if not issubclass(kind, known)] == []
    for index, (kind, _, _) in enumerate(OUTCOMES):
        assert not any(issubclass(kind, above) for above, _, _ in OUTCOMES[:index]), kind


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--samples", "four", "Invalid value for '--samples': It must be a whole number."),
        ("--samples", "0", "Invalid value for '--samples': It must be at least 1."),
        ("--target-error", "5", "--target-error: It must be at most 1."),
        ("--precision", "half", "Invalid value for '--precision': 'half' is not one of 'single', 'double'."),
    ],
)
def test_wrong_value_in_plain_words(here: Penumbra, option: str, value: str, message: str) -> None:
    outcome = here("render", "scene.json", "-o", "a.png", option, value)
    assert outcome.err.splitlines()[0] == f"error: {message}"


def test_service_away(here: Penumbra) -> None:
    assert here("get", "some-id", *NOWHERE.split()).code == ExitCode.SERVER


def test_unusable_limit(here: Penumbra, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PENUMBRA_LIMITS__MAX_PIXELS", "many")
    outcome = here("validate", "scene.json")
    assert outcome.code == ExitCode.USAGE
    assert "PENUMBRA_LIMITS__MAX_PIXELS" in outcome.err


@pytest.mark.slow
def test_unusable_data_folder(penumbra: Penumbra) -> None:
    outcome = penumbra("serve", "--data", "scene.json/data")
    assert outcome.code == ExitCode.SERVER
    assert "The data folder scene.json/data cannot be used: it is below a file." in outcome.err


def test_control_characters_of_a_name_are_not_printed(here: Penumbra) -> None:
    outcome = here("render", "no\x1b[31m\nsuch.json", "-o", "a.png")
    assert outcome.err.startswith("error: no [31m\nsuch.json ")
    assert outcome.err.count("such.json") == 1


def test_unknown_exception_is_a_bug(capsys: pytest.CaptureFixture[str]) -> None:
    assert report(ZeroDivisionError("no sum"), as_json=True) == ExitCode.INTERNAL
    out = capsys.readouterr().out
    assert json.loads(out)["detail"] == "no sum"
    report(ZeroDivisionError("no sum"), as_json=False)
    assert "This is a bug in Penumbra" in capsys.readouterr().err
