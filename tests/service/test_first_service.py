"""The tutorial for operators, followed step by step."""

import os
import re
import shutil
import signal
import socket
import subprocess
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest

from tests.pages import blocks, missing, page
from tests.postgres_server import PostgresServer
from tests.service.cli.conftest import ENVIRONMENT, ROOT

NAME = "tutorials/first-service.md"
PORTS = ("8000", "8001", "8002")


def free_ports(count: int) -> list[str]:
    """Ports that no one uses at this moment."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [str(each.getsockname()[1]) for each in sockets]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("curl") is None, reason="the tutorial uses curl")
def test_tutorial_shows_what_its_commands_print(postgres: PostgresServer, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "scenes", tmp_path / "scenes")
    script = "\n".join(["set -eu -o pipefail", *blocks(page(NAME), "sh")])
    free = dict(zip(PORTS, free_ports(len(PORTS)), strict=True))
    script = re.sub("|".join(PORTS), lambda port: free[port[0]], script)
    script = script.replace("postgresql:///penumbra", f"'{postgres.database()}'").replace(
        "--samples 36", "--samples 9"
    )
    followed = subprocess.Popen(
        ["bash", "-c", script],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=ENVIRONMENT | {"PENUMBRA_WORKERS": "2"},
        start_new_session=True,
    )
    try:
        printed, errors = followed.communicate(timeout=300)
    finally:
        # Whatever failed, no server outlives the test.
        with suppress(ProcessLookupError):
            os.killpg(followed.pid, signal.SIGKILL)
    logs = [path.read_text()[-2000:] for path in tmp_path.glob("*.log")]
    assert followed.returncode == 0, "\n".join([errors, *logs])
    assert missing(NAME, printed) == []
    assert printed.count("penumbra_leads 1.0") == 2
    assert (tmp_path / "survived.png").read_bytes().startswith(b"\x89PNG")
