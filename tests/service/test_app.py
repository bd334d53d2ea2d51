"""Starting a service: what it loads, whose its folder is, what its log shows."""

import os
import pty
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from service.storage.ownership import held
from tests.service.support import TIMEOUT

# What traces, PostgreSQL, buckets, migrations, manifests and clients need.
HEAVY = [
    "opentelemetry.sdk",
    "opentelemetry.exporter",
    "google.protobuf",
    "requests",
    "sqlalchemy.dialects.postgresql",
    "psycopg",
    "obstore",
    "alembic",
    "yaml",
    "schemas.grading",
    "httpx2",
    "distributed",
]
LOADED = f"""
import sys
import service.server
from service.app import create_app
from service.settings import Settings
create_app(Settings())
print([name for name in {HEAVY} if name in sys.modules])
"""


@pytest.mark.slow
def test_service_loads_nothing_that_it_does_not_need() -> None:
    plain = {name: value for name, value in os.environ.items() if not name.startswith(("OTEL_", "PENUMBRA_"))}
    command = [sys.executable, "-c", LOADED]
    assert subprocess.run(command, env=plain, capture_output=True, text=True, check=True).stdout == "[]\n"


def test_data_folder_is_closed_to_other_users_of_the_machine(tmp_path: Path) -> None:
    with held(tmp_path / "new", shared=False):
        assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o700


LOGGED = r"""
import structlog
from service import logs
logs.configure("info")
structlog.get_logger().info('request', path='/a\nforged\x1b[2J\x9b')
def ask(key):
    1 / 0
try:
    ask("secret" * 7)
except ZeroDivisionError:
    structlog.get_logger().exception("failed")
"""


def test_log_on_a_terminal_is_not_steered_and_shows_no_values() -> None:
    ours, theirs = pty.openpty()
    subprocess.run([sys.executable, "-c", LOGGED], stderr=theirs, check=True, timeout=TIMEOUT)
    os.close(theirs)
    shown = os.read(ours, 10_000).decode()
    os.close(ours)
    assert r"/a\nforged\x1b[2J\x9b" in shown.splitlines()[0]
    assert "ZeroDivisionError" in shown
    assert "secretsecret" not in shown
