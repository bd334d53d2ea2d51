"""A command as a process: its streams, and signals at any time."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.service.cli.conftest import COMMAND, ENVIRONMENT, LONG, TIMEOUT, Penumbra, begun, ended
from tests.service.support import until

FULL = pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")


def run(folder: Path, *words: str, **streams: Any) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [*COMMAND, *words], cwd=folder, env=ENVIRONMENT, timeout=TIMEOUT, check=False, **streams
    )


@pytest.mark.parametrize("words", [["--help"], ["explain", "missing.json", "--json"]], ids=" ".join)
def test_closed_pipe_is_silent(tmp_path: Path, words: list[str]) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = run(tmp_path, *words, stdout=writing, stderr=subprocess.PIPE)
    finally:
        os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")


@pytest.mark.slow
@FULL
@pytest.mark.parametrize(
    "words", [["validate", "scene.json"], ["explain", "missing.json", "--json"]], ids=" ".join
)
def test_full_stdout_is_reported(scene_file: Path, words: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        done = run(scene_file.parent, *words, stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 2
    assert done.stderr.startswith(b"error: stdout (/dev/full) ")


@pytest.mark.slow
@FULL
def test_full_stderr_harms_nothing(scene_file: Path) -> None:
    words = ["render", "scene.json", "-o", "a.png", "--workers", "1"]
    with Path("/dev/full").open("w") as full:
        done = run(scene_file.parent, *words, stdout=subprocess.PIPE, stderr=full)
    assert (done.returncode, done.stdout) == (0, b"")
    assert (scene_file.parent / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
@pytest.mark.parametrize(("closed", "code"), [("< scene.json >&- 2>&-", 0), ("<&-", 3)])
def test_closed_streams(scene_file: Path, closed: str, code: int) -> None:
    done = ended(scene_file.parent, program=["bash", "-c", f"{' '.join(COMMAND)} validate - {closed}"])
    assert (done.code, done.err) == (code, "")


@pytest.mark.slow
def test_name_in_an_ascii_terminal(scene_file: Path) -> None:
    name = "Kugel \u00fc \u7403.json"
    scene_file.rename(scene_file.with_name(name))
    done = subprocess.run(
        [*COMMAND, "validate", name],
        capture_output=True,
        cwd=scene_file.parent,
        env=ENVIRONMENT | {"PYTHONIOENCODING": "latin-1"},
        timeout=TIMEOUT,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout == "Kugel \u00fc \\u7403.json: ok\n".encode("latin-1")


@pytest.mark.slow
@pytest.mark.parametrize(("target", "name"), [("-", "a.png"), ("-.npy", "a.npy")])
def test_picture_on_stdout(scene_file: Path, here: Penumbra, tmp_path: Path, target: str, name: str) -> None:
    assert here("render", scene_file, "-o", name, "--workers", 1).code == 0
    done = run(tmp_path, "render", "scene.json", "-o", target, "--workers", "1", stdout=subprocess.PIPE)
    assert (done.returncode, done.stdout) == (0, (tmp_path / name).read_bytes())
    assert sorted(path.name for path in tmp_path.iterdir()) == [name, "scene.json"]


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
INTERRUPTED = "error: Interrupted.\n"


@pytest.mark.parametrize(
    ("module", "number", "option", "code", "message"),
    [
        ("typer", signal.SIGINT, "-", 130, INTERRUPTED),
        ("numpy", signal.SIGINT, "-", 130, INTERRUPTED),
        ("service.cli.failures", signal.SIGINT, "--frobnicate", 130, INTERRUPTED),
        ("numpy", signal.SIGTERM, "-", 143, ""),
        ("numpy", signal.SIGHUP, "-", 129, ""),
        ("typer", signal.SIGINT, "--json", 130, ""),
    ],
)
def test_signal_during_an_import(
    scene_file: Path, module: str, number: signal.Signals, option: str, code: int, message: str
) -> None:
    program = [sys.executable, "-c", AT_IMPORT, module, str(int(number)), "validate", "scene.json"]
    done = ended(scene_file.parent, option, program=program)
    assert (done.code, done.err) == (code, message)
    if option == "--json":
        assert done.document["exit_code"] == code
    else:
        assert done.out == ""


def group(leader: int) -> dict[int, float]:
    """CPU seconds of the living processes of a process group, by their ids."""
    found = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[2]) == leader and fields[0] != "Z":
            ticks = int(fields[11]) + int(fields[12])
            found[int(path.parent.name)] = ticks / os.sysconf("SC_CLK_TCK")
    return found


def at_work(leader: int) -> list[int]:
    """The workers that have been busy for longer than it takes to start."""
    return [pid for pid, seconds in group(leader).items() if pid != leader and seconds > 1.5]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "times", "code"),
    [(signal.SIGINT, 1, 130), (signal.SIGINT, 3, 130), (signal.SIGTERM, 3, 143), (signal.SIGHUP, 3, 129)],
)
def test_interrupted_render_leaves_nothing(
    tmp_path: Path, number: signal.Signals, times: int, code: int
) -> None:
    (tmp_path / "long.json").write_text(json.dumps(LONG))
    with begun(tmp_path, "render", "long.json", "-o", "long.png", "--workers", 2) as render:
        until(lambda: len(at_work(render.pid)) == 2, TIMEOUT)
        for _ in range(times):
            # As a terminal does it: to every process of the command.
            os.killpg(render.pid, number)
        _, messages = render.communicate(timeout=TIMEOUT)
    assert render.returncode == code
    assert "Traceback" not in messages
    until(lambda: not group(render.pid), TIMEOUT)
    assert [path.name for path in tmp_path.iterdir()] == ["long.json"]


@pytest.mark.slow
def test_killed_render_leaves_no_process(tmp_path: Path) -> None:
    (tmp_path / "long.json").write_text(json.dumps(LONG))
    with begun(tmp_path, "render", "long.json", "-o", "long.png", "--workers", 2) as render:
        until(lambda: len(at_work(render.pid)) == 2, TIMEOUT)
        render.kill()
    until(lambda: not group(render.pid), TIMEOUT)


DROPPED = """
import signal, sys, time
from service import logs
from service.cli.process import Signals

class Finalized:
    def __del__(self):
        signal.raise_signal(int(sys.argv[1]))

Signals(as_json=False).raise_exceptions()
logs.configure("error")
try:
    Finalized()
    time.sleep(60)
except (KeyboardInterrupt, SystemExit) as caught:
    print(type(caught).__name__)
"""


@pytest.mark.parametrize(
    ("number", "raised"), [(signal.SIGINT, "KeyboardInterrupt"), (signal.SIGTERM, "SystemExit")]
)
def test_signal_in_a_finalizer_is_not_lost(tmp_path: Path, number: signal.Signals, raised: str) -> None:
    words = [sys.executable, "-c", DROPPED, str(int(number))]
    done = subprocess.run(
        words, cwd=tmp_path, env=ENVIRONMENT, timeout=30, check=True, capture_output=True, text=True
    )
    assert (done.stdout, done.stderr) == (f"{raised}\n", "")
