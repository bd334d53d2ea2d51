"""Ctrl-C and other signals, at any time during a command."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests.service.cli.conftest import CLEAN, COMMAND

ROOT = Path(__file__).parents[3]
AT_IMPORT = """
import os, signal, sys

# What starts the tests in the background, or nohup, may have made them ignore these.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)

class Signalling:
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[1]:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), int(sys.argv[2]))

sys.meta_path.insert(0, Signalling())
from service.cli.main import main
main(sys.argv[3:])
"""
SECONDS = 60


def _signalled(folder: Path, module: str, number: int, *words: str) -> subprocess.CompletedProcess[str]:
    """Run a command that is sent a signal when it begins to import a module."""
    return subprocess.run(
        [sys.executable, "-c", AT_IMPORT, module, str(number), *words],
        capture_output=True,
        text=True,
        cwd=folder,
        env=CLEAN | {"PYTHONPATH": str(ROOT)},
        timeout=SECONDS,
        check=False,
    )


@pytest.mark.parametrize("module", ["typer", "service.cli.watch", "numpy", "PIL", "renderer"])
def test_ctrl_c_during_imports(scene_file: Path, module: str) -> None:
    done = _signalled(scene_file.parent, module, signal.SIGINT, "validate", "scene.json")
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: Interrupted.\n")


def test_ctrl_c_during_a_failure(scene_file: Path) -> None:
    done = _signalled(scene_file.parent, "service.cli.failures", signal.SIGINT, "validate", "--frobnicate")
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: Interrupted.\n")


@pytest.mark.parametrize("module", ["typer", "numpy"])
def test_interruption_as_json(scene_file: Path, module: str) -> None:
    done = _signalled(scene_file.parent, module, signal.SIGINT, "validate", "scene.json", "--json")
    assert (done.returncode, done.stderr) == (130, "")
    assert json.loads(done.stdout)["exit_code"] == 130


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_term_and_hup_are_silent(scene_file: Path, number: signal.Signals, code: int) -> None:
    done = _signalled(scene_file.parent, "numpy", number, "validate", "scene.json")
    assert (done.returncode, done.stdout, done.stderr) == (code, "", "")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_repeated_signal_leaves_nothing(
    scene_file: Path, scene: dict[str, Any], number: signal.Signals, code: int
) -> None:
    scene["sampling"] = {"antialiasing": {"pattern": "stratified", "samples": 1024}}
    scene["camera"] |= {"width": 1024, "height": 1024}
    scene_file.write_text(json.dumps(scene))
    process = subprocess.Popen(
        [
            "env",
            "--default-signal=INT,HUP",
            *COMMAND,
            "render",
            "scene.json",
            "-o",
            "a.png",
            "--workers",
            "2",
        ],
        stderr=subprocess.PIPE,
        text=True,
        cwd=scene_file.parent,
        env=CLEAN | {"PYTHONPATH": str(ROOT)},
        start_new_session=True,
    )
    workers = _wait_for_children(process.pid, count=3)  # two workers and Python's tracker of resources
    for _ in range(3):
        # As a terminal does it: to every process of the command.
        os.killpg(process.pid, number)
    _, err = process.communicate(timeout=SECONDS)
    assert process.returncode == code
    assert "Traceback" not in err
    assert list(scene_file.parent.iterdir()) == [scene_file]
    assert [pid for pid in workers if _runs(pid)] == []


def _wait_for_children(pid: int, count: int) -> list[int]:
    deadline = time.monotonic() + SECONDS
    while len(found := _children(pid)) < count:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return found


def _children(pid: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def _runs(pid: int) -> bool:
    """Whether a process is there and not merely waits for its parent to take note of its end."""
    deadline = time.monotonic() + SECONDS
    while time.monotonic() < deadline:
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return False
        if state == "Z":
            return False
        time.sleep(0.02)
    return True
