"""The client while the service restarts."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

import pytest

from tests.acceptance.conftest import COMMAND, ENVIRONMENT, Penumbra, Server

pytestmark = pytest.mark.slow

TIMEOUT = 30
"""Seconds after which a process that has not ended is one that stays."""


def test_waiting_outlasts_a_killed_service_and_the_image_is_the_same(
    penumbra: Penumbra, server: Server, scene_file: Path, tmp_path: Path
) -> None:
    more = ["--samples", 100, "--light-samples", 36]
    assert penumbra("render", scene_file, "-o", "here.png", *more).code == 0
    job_id = penumbra("submit", scene_file, *more).out.strip()
    words = [*COMMAND, "watch", job_id]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, text=True, env=ENVIRONMENT | {"PENUMBRA_SERVER": server.url}
    ) as watching:
        assert watching.stdout is not None
        first = watching.stdout.readline()
        server.kill()
        server.start()
        rest = watching.stdout.read().splitlines()
    assert watching.returncode == 0
    numbers = [int(line.partition("/")[0]) for line in [first, *rest] if "\ttile " in line]
    assert numbers == list(range(1, len(numbers) + 1))
    assert penumbra("get", job_id, "-o", "sent.png").code == 0
    assert (tmp_path / "sent.png").read_bytes() == (tmp_path / "here.png").read_bytes()


def test_while_the_service_is_away_every_command_says_so(
    penumbra: Penumbra, server: Server, scene_file: Path
) -> None:
    server.stop()
    for words in (["ls"], ["get", "x"], ["submit", scene_file]):
        outcome = penumbra(*words)
        assert outcome.code == 4
        assert server.url in outcome.err
        assert outcome.err.count("penumbra serve") == 1
    server.start()
    assert penumbra("ls").code == 0


def test_a_second_service_on_the_same_port_or_folder_says_what_is_wrong(
    penumbra: Penumbra, server: Server
) -> None:
    taken = {
        f"Another program uses port {server.port} of 127.0.0.1": ["--port", server.port, "--data", "other"],
        f"Another service uses {server.folder / 'data'}": ["--port", 0, "--data", server.folder / "data"],
    }
    for reason, words in taken.items():
        outcome = penumbra("serve", *words)
        assert outcome.code == 4
        assert outcome.out == ""
        assert reason in outcome.err
        assert "could not start" in outcome.err


def test_a_stopped_service_leaves_no_process(server: Server) -> None:
    group = _children(server.process.pid)
    assert group
    server.stop()
    assert server.process.returncode == 0
    deadline = time.monotonic() + TIMEOUT
    while left := [pid for pid in group if Path(f"/proc/{pid}").exists()]:
        assert time.monotonic() < deadline, left
        time.sleep(0.02)
    server.start()


def _children(parent: int) -> list[int]:
    tasks = Path(f"/proc/{parent}/task").glob("*/children")
    return [int(pid) for task in tasks for pid in task.read_text().split()]
