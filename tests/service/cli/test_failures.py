"""Exit codes, and what is on stdout and stderr, whatever goes wrong."""

from __future__ import annotations

import inspect
import json
from pathlib import Path
from typing import Any

import pytest

from service.cli import errors as cli_errors
from service.cli.errors import ExitCode
from service.cli.failures import OUTCOMES
from service.client import errors as client_errors
from tests.service.cli.conftest import Outcome, Penumbra

NOWHERE = "http://127.0.0.1:9"
WRONG_USE = {
    "no command": [],
    "no such command": ["frobnicate"],
    "no such option": ["ls", "--frobnicate"],
    "no scene": ["render", "-o", "a.png"],
    "no target": ["render", "scene.json"],
    "unknown format": ["render", "scene.json", "-o", "a.jpg"],
    "folder missing": ["render", "scene.json", "-o", "missing/a.png"],
    "folder as target": ["get", "some-id", "-o", "folder.png"],
    "no file can be made there": ["render", "scene.json", "-o", "/proc/a.png"],
    "hits must be npz": ["trace", "scene.json", "rays.npz", "-o", "hits.npy"],
    "zero samples": ["render", "scene.json", "-o", "a.png", "--samples", "0"],
    "unknown pattern": ["render", "scene.json", "-o", "a.png", "--pattern", "spiral"],
    "not a square": ["render", "scene.json", "-o", "a.png", "--samples", "5", "--pattern", "uniform"],
    "not a square light": ["explain", "scene.json", "--light-samples", "5"],
    "an ending alone": ["render", "scene.json", "-o", ".png"],
    "an empty name": ["render", "scene.json", "-o", ""],
    "an empty id": ["wait", ""],
    "an empty id among others": ["delete", "some-id", ""],
    "more workers than a machine holds": ["render", "scene.json", "-o", "a.png", "--workers", "100000000"],
    "a seed that no scene may have": ["render", "scene.json", "-o", "a.png", "--seed", "9007199254740992"],
    "a job without an id": ["compare", "job:", "a.png"],
    "stdout for two": ["render", "scene.json", "-o", "-", "--json"],
    "no file beside stdout": ["submit", "scene.json", "-o", "-", "--layers", "depth"],
    "time-out without waiting": ["submit", "scene.json", "--timeout", "3"],
}
UNUSABLE = {
    "missing scene": ["render", "missing.json", "-o", "a.png"],
    "scene is a folder": ["explain", "folder.png"],
    "broken scene": ["render", "broken.json", "-o", "a.png"],
    "an empty scene": ["render", "empty.json", "-o", "a.png"],
    "an empty scene among others": ["validate", "scene.json", "empty.json"],
    "nothing on stdin": ["explain", "-"],
    "a scene without a name": ["explain", ""],
    "more brackets than anything may have": ["validate", "brackets.json"],
    "broken scene explained": ["explain", "broken.json"],
    "broken scene validated": ["validate", "broken.json"],
    "missing rays": ["trace", "scene.json", "missing.npz", "-o", "hits.npz"],
    "rays are no arrays": ["trace", "scene.json", "scene.json", "-o", "hits.npz"],
    "scene without its texture": ["render", "textured.json", "-o", "a.png"],
    "not json, submitted": ["submit", "broken.json", "--server", NOWHERE],
    "texture not there, submitted": ["submit", "textured.json", "--server", NOWHERE],
}
NO_SERVER = {
    "ls": ["ls"],
    "get": ["get", "some-id"],
    "cancel": ["cancel", "some-id"],
    "submit": ["submit", "scene.json"],
    "address without scheme": ["ls", "--server", "somewhere"],
}


@pytest.fixture(autouse=True)
def _files(tmp_path: Path, scene_file: Path, scene: dict[str, Any]) -> None:
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "empty.json").touch()
    (tmp_path / "brackets.json").write_text("[" * 20_000_000)
    (tmp_path / "broken.json").write_text('{"version": 1,\n "camera": }')
    textured = {
        "textures": {"wood": {"type": "image", "asset": "wood.png"}},
        "materials": {"floor": {"type": "phong", "color_texture": "wood"}},
    }
    (tmp_path / "textured.json").write_text(json.dumps(scene | textured))


def _cases(*tables: tuple[ExitCode, dict[str, list[str]]]) -> list[Any]:
    return [pytest.param(code, words, id=name) for code, table in tables for name, words in table.items()]


FILES = _cases((ExitCode.USAGE, WRONG_USE), (ExitCode.UNUSABLE_INPUT, UNUSABLE))
ALL = [*FILES, *_cases((ExitCode.SERVER, NO_SERVER))]


@pytest.mark.parametrize(("code", "words"), [case for case in ALL if case.id != "no command"])
def test_exit_code_by_kind(here: Penumbra, tmp_path: Path, code: ExitCode, words: list[str]) -> None:
    before = sorted(tmp_path.rglob("*"))
    outcome = here(*_with_server(words))
    assert outcome.code == code
    assert "Traceback" not in outcome.out + outcome.err
    assert outcome.out + outcome.err != ""
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(("code", "words"), [case for case in FILES if case.id != "no command"])
def test_failure_as_json(here: Penumbra, code: ExitCode, words: list[str]) -> None:
    _assert_one_document(here(*_with_server(words), "--json"), code, words)


def _assert_one_document(outcome: Outcome, code: ExitCode, words: list[str]) -> None:
    assert outcome.code == code
    document = outcome.document
    assert isinstance(document, dict)
    if words[0] != "validate":
        assert document["title"]
        assert document["exit_code"] == code
    assert "{" not in outcome.err


def test_every_exception_has_an_exit_code() -> None:
    known = tuple(kind for kind, _, _ in OUTCOMES)
    raised = [
        kind
        for module in (cli_errors, client_errors)
        for _, kind in inspect.getmembers(module, inspect.isclass)
        if issubclass(kind, Exception) and kind.__module__ == module.__name__
    ]
    assert len(raised) > 10
    assert [kind.__name__ for kind in raised if not issubclass(kind, known)] == []


def test_no_row_is_hidden_by_another() -> None:
    for index, (kind, _, _) in enumerate(OUTCOMES):
        assert not any(issubclass(kind, above) for above, _, _ in OUTCOMES[:index]), kind


def _with_server(words: list[str]) -> list[str]:
    talks = words and words[0] in {"ls", "get", "cancel", "submit"} and "--server" not in words
    return [*words, "--server", NOWHERE] if talks else words


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--samples", "four", "Invalid value for '--samples': It must be a whole number."),
        ("--samples", "0", "Invalid value for '--samples': It must be at least 1."),
        ("--target-error", "small", "Invalid value for '--target-error': It must be a number."),
        ("--target-error", "5", "--target-error: It must be at most 1."),
        ("--time-limit", "5", "--time-limit is part of target quality. Give --target-error too."),
        ("--precision", "half", "Invalid value for '--precision': 'half' is not one of 'single', 'double'."),
    ],
)
def test_wrong_value_in_plain_words(here: Penumbra, option: str, value: str, message: str) -> None:
    outcome = here("render", "scene.json", "-o", "a.png", option, value)
    assert outcome.err.splitlines()[0] == f"error: {message}"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("folder", "reason"), [("scene.json", "it is a file"), ("scene.json/data", "it is below a file")]
)
def test_unusable_data_folder(penumbra: Penumbra, folder: str, reason: str) -> None:
    outcome = penumbra("serve", "--data", folder)
    assert outcome.code == ExitCode.SERVER
    assert f"The data folder {folder} cannot be used: {reason}." in outcome.err


def test_mistake_is_reported_once(here: Penumbra) -> None:
    outcome = here("render", "no\x1b[31m\nsuch.json", "-o", "a.png")
    assert outcome.err.startswith("error: no [31m\nsuch.json ")
    assert outcome.err.count("such.json") == 1
