"""Imports at the start of a command, and completion in a shell."""

import shutil
import sys
from pathlib import Path
from typing import get_args

import pytest

from schemas.api.jobs import JobRequest, JobState
from schemas.quality import Sampling
from service.cli.options import LARGEST_SEED, MOST_WORKERS, PRIORITIES, State
from service.settings import Settings
from tests.service.cli.conftest import Penumbra, ended

HEAVY = ("numpy", "PIL", "fastapi", "sqlalchemy", "httpx2", "uvicorn", "renderer", "schemas")
PROBE = f"""
import sys
from service.cli.main import main
for name in sys.argv[1:]:
    try:
        main([*name.split(), "--help"])
    except SystemExit as left:
        assert not left.code
print(*[name for name in {HEAVY} if name in sys.modules], file=sys.stderr)
"""


def test_help_loads_no_large_library(tmp_path: Path) -> None:
    # Any of them imports the modules of all.
    done = ended(tmp_path, "", "render", "keys add", program=[sys.executable, "-c", PROBE])
    assert (done.code, done.err.strip()) == (0, "")
    assert done.out.count("Usage: ") == 3


def test_option_limits_are_those_of_the_service() -> None:
    """The command line has its own, so that it need not load the schemas."""
    priority = JobRequest.model_json_schema()["properties"]["priority"]
    workers = Settings.model_json_schema()["properties"]["workers"]
    seed = Sampling.model_json_schema()["properties"]["seed"]
    assert get_args(State) == tuple(JobState)
    assert (priority["minimum"], priority["maximum"]) == PRIORITIES
    assert (workers["maximum"], seed["maximum"]) == (MOST_WORKERS, LARGEST_SEED)


# The function that the script has registered, called as Readline would.
COMPLETE = r"""
eval "$(penumbra completion bash)"
function=$(complete -p penumbra | sed 's/.*-F \([^ ]*\).*/\1/')
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); $function penumbra; printf "%s\n" "${COMPREPLY[@]}"
"""


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
@pytest.mark.parametrize(
    ("words", "completed"),
    [
        (["re"], ["render", "resume"]),
        (["submit", "--pr"], ["--precision", "--priority"]),
        (["render", "--pattern", "s"], ["stratified", "sobol"]),
    ],
    ids=["command", "option", "value"],
)
def test_bash_completes_words(tmp_path: Path, words: list[str], completed: list[str]) -> None:
    program = ["bash", "--norc", "-euc", COMPLETE, "bash", "penumbra"]
    done = ended(tmp_path, *words, program=program)
    assert (done.code, done.err) == (0, "")
    assert done.out.split() == completed


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_script_of_each_shell(here: Penumbra, shell: str) -> None:
    outcome = here("completion", shell)
    assert outcome.code == 0
    assert "_PENUMBRA_COMPLETE=complete_" + shell in outcome.out
