"""The command line: in this process where its text and exit status are tried, or as one of its own."""

import copy
import io
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from service.cli.process import outcome
from tests.service import support

ROOT = Path(__file__).parents[3]
COMMAND = [sys.executable, "-m", "service.cli.main"]
# Nothing of the machine that the tests run on may leak into them; `penumbra` is that of this Python.
CLEAN = {name: value for name, value in os.environ.items() if not name.startswith("PENUMBRA_")}
ENVIRONMENT = CLEAN | {
    "PYTHONPATH": str(ROOT),
    "PATH": f"{Path(sys.executable).parent}:{os.environ.get('PATH', '')}",
}
TIMEOUT = 120

SCENE = support.scene(48, 32, samples=1, light_samples=1)
LONG = support.scene(1024, 1024, samples=1024)
"""Takes far longer than any test."""


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str

    @property
    def document(self) -> Any:
        """All of stdout as one JSON document."""
        return json.loads(self.out)


Penumbra = Callable[..., Outcome]


def ended(
    folder: Path,
    *words: object,
    program: list[str] = COMMAND,
    stdin: str = "",
    timeout: float = TIMEOUT,
    **environment: str,
) -> Outcome:
    """Run the command, or another program, in a process until it ends."""
    done = subprocess.run(
        [*program, *map(str, words)],
        input=stdin,
        capture_output=True,
        text=True,
        cwd=folder,
        env=ENVIRONMENT | environment,
        timeout=timeout,
        check=False,
    )
    return Outcome(done.returncode, done.stdout, done.stderr)


def begun(
    folder: Path, *words: object, stderr: Any = subprocess.PIPE, **environment: str
) -> subprocess.Popen[str]:
    """Start the command as the leader of a group of processes, to be sent signals."""
    # What starts the tests in the background may have made them ignore these.
    command = ["env", "--default-signal=INT,HUP", *COMMAND, *map(str, words)]
    return subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=stderr,
        text=True,
        cwd=folder,
        env=ENVIRONMENT | environment,
        process_group=0,
    )


@pytest.fixture
def penumbra(tmp_path: Path) -> Penumbra:
    """Run the command in a process, in an empty folder."""

    def run(*words: object, stdin: str = "") -> Outcome:
        return ended(tmp_path, *words, stdin=stdin)

    return run


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Penumbra:
    """Run the command in this process, which has loaded everything, as if it were one of its own."""
    for name in set(os.environ) - set(CLEAN):
        monkeypatch.delenv(name)
    # Commands set it to what --config names.
    monkeypatch.setenv("PENUMBRA_CONFIG", "")
    monkeypatch.delenv("PENUMBRA_CONFIG")
    monkeypatch.chdir(tmp_path)

    def run(*words: object, stdin: str = "") -> Outcome:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin.encode())))
        code = outcome([str(word) for word in words])
        return Outcome(code, *capsys.readouterr())

    return run


@pytest.fixture
def on_a_terminal(here: Penumbra, monkeypatch: pytest.MonkeyPatch) -> Penumbra:
    """Run the command as if stdout were a terminal of 80 columns; without its colors."""
    monkeypatch.setenv("COLUMNS", "80")

    def run(*words: object) -> Outcome:
        monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
        done = here(*words)
        return replace(done, out=re.sub(r"\x1b\[[\d;]*m", "", done.out))

    return run


@pytest.fixture
def scene() -> dict[str, Any]:
    """A small scene, to be changed."""
    return copy.deepcopy(SCENE)


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    """A small scene that is fine."""
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(SCENE, indent=2))
    return path
