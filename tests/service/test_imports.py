"""What a service loads as it starts: every import makes those wait who start it."""

import os
import subprocess
import sys

# What traces, PostgreSQL, buckets, migrations, manifests and clients need.
HEAVY = (
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
)
LOADED = f"""
import sys
import service.server
from service.app import create_app
from service.settings import Settings
create_app(Settings())
print([name for name in {HEAVY} if name in sys.modules])
"""


def test_a_service_loads_nothing_that_it_does_not_need_itself() -> None:
    plain = {name: value for name, value in os.environ.items() if not name.startswith(("OTEL_", "PENUMBRA_"))}
    command = [sys.executable, "-c", LOADED]
    assert subprocess.run(command, env=plain, capture_output=True, text=True, check=True).stdout == "[]\n"
