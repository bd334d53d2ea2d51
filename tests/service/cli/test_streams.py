"""stdout and stderr that take nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.service.cli.conftest import CLEAN, COMMAND

ROOT = Path(__file__).parents[3]
WORDS = {
    "help": ["--help"],
    "lines": ["validate", "scene.json"],
    "a document": ["explain", "scene.json", "--json"],
    "a failure": ["validate", "missing.json"],
    "a failure as a document": ["explain", "missing.json", "--json"],
}
COMMANDS = pytest.mark.parametrize("words", [pytest.param(words, id=name) for name, words in WORDS.items()])
FULL = pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")


def _run(folder: Path, words: list[str], **streams: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COMMAND, *words],
        text=True,
        cwd=folder,
        env=CLEAN | {"PYTHONPATH": str(ROOT)},
        timeout=60,
        check=False,
        **streams,
    )


@COMMANDS
def test_closed_pipe_is_silent(scene_file: Path, words: list[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = _run(scene_file.parent, words, stdout=writing, stderr=subprocess.PIPE)
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.slow
@FULL
@COMMANDS
def test_full_stdout_is_reported(scene_file: Path, words: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        done = _run(scene_file.parent, words, stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 2
    assert done.stderr.startswith("error: stdout (/dev/full) ")
    assert "write elsewhere" in done.stderr


@FULL
def test_full_stderr_harms_nothing(scene_file: Path) -> None:
    words = ["render", "scene.json", "-o", "a.png", "--workers", "1"]
    with Path("/dev/full").open("w") as full:
        done = _run(scene_file.parent, words, stdout=subprocess.PIPE, stderr=full)
    assert (done.returncode, done.stdout) == (0, "")
    assert (scene_file.parent / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_closed_streams(scene_file: Path) -> None:
    script = f'{sys.executable} -m service.cli.main validate - "$@"'
    for closed, code in (("< scene.json >&- 2>&-", 0), ("<&-", 3)):
        words = ["bash", "-c", f"{script} {closed}"]
        done = subprocess.run(
            words,
            capture_output=True,
            text=True,
            cwd=scene_file.parent,
            env=CLEAN | {"PYTHONPATH": str(ROOT)},
            timeout=60,
            check=False,
        )
        assert (done.returncode, done.stderr) == (code, "")


@pytest.mark.slow
def test_name_in_an_ascii_terminal(scene_file: Path) -> None:
    scene_file.rename(scene_file.with_name("Kugel \u00fc \u7403.json"))
    environment = {"PYTHONIOENCODING": "latin-1"}
    for words in (
        ["validate", "Kugel \u00fc \u7403.json"],
        ["validate", "Kugel \u00fc \u7403.json", "--json"],
    ):
        done = subprocess.run(
            [*COMMAND, *words],
            capture_output=True,
            cwd=scene_file.parent,
            env=CLEAN | environment | {"PYTHONPATH": str(ROOT)},
            timeout=60,
            check=False,
        )
        assert (done.returncode, done.stderr) == (0, b"")
        if "--json" in words:
            assert json.loads(done.stdout)["files"][0]["file"] == words[1]
        else:
            assert done.stdout == "Kugel \u00fc \\u7403.json: ok\n".encode("latin-1")
