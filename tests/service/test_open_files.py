"""The limit of open files: raised at the start, or the start is refused."""

import resource
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import httpx2
import pytest

from service.cli.errors import ExitCode
from service.server import running
from service.settings import Settings
from tests.service.sending import connected
from tests.service.support import TIMEOUT

LOW, MORE = 256, 300
REQUEST = b"GET /v1/jobs HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"


@pytest.mark.slow
def test_low_limit_is_raised_as_far_as_connections_need(tmp_path: Path) -> None:
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    with ExitStack() as stack:
        resource.setrlimit(resource.RLIMIT_NOFILE, (LOW, before[1]))
        try:
            server = stack.enter_context(running(Settings(data=tmp_path, port=0, workers=1)))
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, before)
        for _ in range(MORE):
            stack.enter_context(connected(server, REQUEST))
        assert httpx2.get(f"{server.url}/v1/jobs", timeout=TIMEOUT).status_code == 200


@pytest.mark.slow
def test_limit_that_cannot_be_raised_is_refused_with_numbers(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "service.cli.main", "serve", "--port", "0", "--data", str(tmp_path)]
    limited = ["bash", "-c", f'ulimit -n {LOW}; exec "$@"', "-", *command]
    refused = subprocess.run(limited, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    assert refused.returncode == ExitCode.SERVER
    for said in (str(LOW), "max_connections", "ulimit"):
        assert said in refused.stderr
