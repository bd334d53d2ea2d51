from __future__ import annotations

import re
import subprocess
import sys
from typing import get_args

import pytest

from schemas.api.jobs import JobRequest, JobState
from schemas.quality import Sampling
from service.cli.commands import COMMANDS
from service.cli.options import DEFAULT_SERVER, LARGEST_SEED, MOST_WORKERS, PRIORITIES, State
from service.client import DEFAULT_SERVER as CLIENT_DEFAULT
from service.settings import Settings
from tests.service.cli.conftest import Penumbra

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


def test_the_table_has_every_command_of_the_contract() -> None:
    assert {name for name, _, _ in COMMANDS} == CONTRACT


@pytest.mark.parametrize(
    "words", [["--help"], ["--version"], *([name, "--help"] for name in sorted(CONTRACT))]
)
def test_help_comes_without_loading_any_large_library(words: list[str]) -> None:
    probe = PROBE.format(heavy=HEAVY)
    done = subprocess.run(
        [sys.executable, "-c", probe, *words], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stderr.strip() == ""
    assert done.stdout.strip() != ""


def test_jobs_are_listed_by_every_state_that_there_is() -> None:
    assert get_args(State) == tuple(JobState)


def test_priorities_are_those_that_a_service_takes() -> None:
    least, most = (
        JobRequest.model_json_schema()["properties"]["priority"][end] for end in ("minimum", "maximum")
    )
    assert (least, most) == PRIORITIES


def test_limits_of_options_are_those_of_what_they_set() -> None:
    workers = Settings.model_json_schema()["properties"]["workers"]
    seed = Sampling.model_json_schema()["properties"]["seed"]
    assert (workers["maximum"], seed["maximum"]) == (MOST_WORKERS, LARGEST_SEED)


def test_command_line_and_client_look_for_the_server_in_the_same_place() -> None:
    assert DEFAULT_SERVER == CLIENT_DEFAULT


@pytest.mark.parametrize(
    "words", [["--help"], ["serve", "--help"], ["keys", "--help"], ["keys", "ls", "--help"]]
)
def test_help_shows_flags_as_words_that_take_no_value(words: list[str], here: Penumbra) -> None:
    shown = here(*words).out
    assert re.search(r"--help +-h +Show this message", shown)
    assert "bool" not in shown
