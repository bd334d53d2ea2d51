from __future__ import annotations

import subprocess
import sys
from typing import get_args

import pytest

from schemas.api.jobs import JobRequest, JobState
from schemas.quality import Sampling
from service.cli.commands import COMMANDS
from service.cli.options import LARGEST_SEED, MOST_WORKERS, PRIORITIES, State
from service.settings import Settings

CONTRACT = {
    "render", "validate", "explain", "quote", "trace", "study", "serve", "submit", "wait", "watch", "get",
    "cancel", "pause", "resume", "pin", "unpin", "prune", "ls", "logs", "demo", "doctor", "compare", "grade",
    "convert", "delete", "completion",
}  # fmt: skip
HEAVY = ("numpy", "PIL", "fastapi", "sqlalchemy", "httpx2", "uvicorn", "renderer", "schemas")
PROBE = """
import sys
from service.cli.main import main
try:
    main(sys.argv[1:])
except SystemExit:
    loaded = [name for name in {heavy!r} if name in sys.modules]
    print(*loaded, file=sys.stderr)
"""


def test_commands_of_the_contract() -> None:
    assert {name for name, _, _ in COMMANDS} == CONTRACT


@pytest.mark.parametrize(
    "words", [["--help"], ["--version"], *([name, "--help"] for name in sorted(CONTRACT))]
)
def test_help_loads_no_large_library(words: list[str]) -> None:
    probe = PROBE.format(heavy=HEAVY)
    done = subprocess.run(
        [sys.executable, "-c", probe, *words], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stderr.strip() == ""
    assert done.stdout.strip() != ""


def test_states_of_ls() -> None:
    assert get_args(State) == tuple(JobState)


def test_priorities_of_the_service() -> None:
    least, most = (
        JobRequest.model_json_schema()["properties"]["priority"][end] for end in ("minimum", "maximum")
    )
    assert (least, most) == PRIORITIES


def test_option_limits() -> None:
    workers = Settings.model_json_schema()["properties"]["workers"]
    seed = Sampling.model_json_schema()["properties"]["seed"]
    assert (workers["maximum"], seed["maximum"]) == (MOST_WORKERS, LARGEST_SEED)
