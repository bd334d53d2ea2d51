"""``penumbra completion``: what lets a shell complete commands and options."""

from __future__ import annotations

import os
from typing import Annotated, Literal

import typer

from service.cli import output

Shell = Literal["bash", "zsh", "fish"]
ShellArgument = Annotated[
    Shell, typer.Argument(metavar="SHELL", help="bash, zsh or fish.", show_default=False)
]
COMMAND = "penumbra"
VARIABLE = "_PENUMBRA_COMPLETE"
"""Set by the script when a shell asks what may follow."""


def completion(shell: ShellArgument) -> None:
    """Print a script that lets a shell complete commands and options: eval "$(penumbra completion bash)"."""
    # Typer has it for its own option alone, which asks the process above which shell it is.
    from typer.completion import get_completion_script  # type: ignore[attr-defined]

    output.result(get_completion_script(prog_name=COMMAND, complete_var=VARIABLE, shell=shell))


def prepare() -> None:
    """Know how to answer, where a shell asks."""
    if VARIABLE in os.environ:
        from typer.completion import completion_init  # type: ignore[attr-defined]

        completion_init()
