"""Completion of commands and options, by a real shell where one is installed."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.service.cli.conftest import CLEAN, Penumbra

ROOT = Path(__file__).parents[3]


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """One in which `penumbra` is a command."""
    command = tmp_path / "bin" / "penumbra"
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m service.cli.main "$@"\n')
    command.chmod(0o755)
    return CLEAN | {"PYTHONPATH": str(ROOT), "PATH": f"{command.parent}:{CLEAN['PATH']}"}


def _completed(environment: dict[str, str], *words: str) -> list[str]:
    """What bash offers for the last of these words."""
    script = 'eval "$(penumbra completion bash)"\n'
    # The function that the script has registered, called as Readline would.
    script += "function=$(complete -p penumbra | sed 's/.*-F \\([^ ]*\\).*/\\1/')\n"
    script += (
        'COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); $function penumbra; printf "%s\\n" "${COMPREPLY[@]}"'
    )
    done = subprocess.run(
        ["bash", "--norc", "-euc", script, "bash", *words],
        capture_output=True,
        text=True,
        env=environment,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.split()


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes_words(environment: dict[str, str]) -> None:
    assert _completed(environment, "penumbra", "re") == ["render", "resume"]
    assert _completed(environment, "penumbra", "submit", "--pr") == ["--precision", "--priority"]
    assert _completed(environment, "penumbra", "render", "--pattern", "s") == ["stratified", "sobol"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_script_of_each_shell(here: Penumbra, shell: str) -> None:
    outcome = here("completion", shell)
    assert outcome.code == 0
    assert "penumbra" in outcome.out
    assert "_PENUMBRA_COMPLETE=complete_" + shell in outcome.out
