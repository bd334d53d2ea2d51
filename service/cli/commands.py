"""The table of commands, and shell completion."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Annotated, Any, Literal

import typer

from service.cli import (
    compare,
    convert,
    doctor,
    explain,
    grade,
    handout,
    job_control,
    jobs,
    keys,
    output,
    quote,
    render,
    serve,
    study,
    submit,
    watch,
)
from service.cli.errors import ExitCode
from service.cli.help_pages import Command, Group

Shell = Literal["bash", "zsh", "fish"]
ShellArgument = Annotated[
    Shell, typer.Argument(metavar="SHELL", help="bash, zsh or fish.", show_default=False)
]
COMMAND = "penumbra"
VARIABLE = "_PENUMBRA_COMPLETE"
"""Set by the script when a shell asks for completions."""


def completion(shell: ShellArgument) -> None:
    """Print a script that completes commands and options in a shell.

    Run it in your shell: eval "$(penumbra completion bash)".
    """
    # Typer offers this only as an option, which detects the shell from the parent process.
    from typer.completion import get_completion_script  # type: ignore[attr-defined]

    output.result(get_completion_script(prog_name=COMMAND, complete_var=VARIABLE, shell=shell))


def _prepare_completion() -> None:
    """Answer a shell that asks for completions."""
    if VARIABLE in os.environ:
        from typer.completion import completion_init  # type: ignore[attr-defined]

        completion_init()


COMMANDS: tuple[tuple[str, str, Callable[..., Any]], ...] = (
    ("render", "On this machine", render.render),
    ("validate", "On this machine", explain.validate),
    ("explain", "On this machine", explain.explain),
    ("quote", "On this machine", quote.quote),
    ("trace", "On this machine", render.trace),
    ("study", "On this machine", study.study),
    ("compare", "On this machine", compare.compare),
    ("convert", "On this machine", convert.convert),
    ("grade", "On this machine", grade.grade),
    ("handout", "On this machine", handout.handout),
    ("serve", "Service", serve.serve),
    ("demo", "Service", serve.demo),
    ("doctor", "Service", doctor.doctor),
    ("completion", "Service", completion),
    ("prune", "Service", job_control.prune),
    ("submit", "Client", submit.submit),
    ("wait", "Client", watch.wait),
    ("watch", "Client", watch.watch),
    ("get", "Client", jobs.get),
    ("cancel", "Client", job_control.cancel),
    ("delete", "Client", job_control.delete),
    ("pause", "Client", job_control.pause),
    ("resume", "Client", job_control.resume),
    ("ls", "Client", jobs.ls),
    ("logs", "Client", jobs.logs),
    ("pin", "Client", job_control.pin),
    ("unpin", "Client", job_control.unpin),
)


def application() -> typer.Typer:
    """The command line with all its commands."""
    app = typer.Typer(
        cls=Group,
        help="Render ray-traced scenes here, or on a service that streams the tiles back.",
        epilog="Exit codes: 0 done, 1 a check found wrong answers, 2 usage, 3 input not usable, "
        "4 server or network, 5 timeout, 130 interrupted.",
        add_completion=False,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback(invoke_without_command=True)(_before_any_command)
    for name, panel, function in COMMANDS:
        app.command(name, cls=Command, rich_help_panel=panel)(function)
    app.add_typer(keys.app, name="keys", rich_help_panel="Service")
    return app


def run(arguments: Sequence[str]) -> int:
    """Run one command and return its exit code; errors are raised."""
    _prepare_completion()
    code: int | None = application()(list(arguments), prog_name=COMMAND, standalone_mode=False)
    return code or ExitCode.DONE


def _before_any_command(
    context: typer.Context,
    version: bool = typer.Option(False, "--version", help="Print the version and exit."),
) -> None:
    if version:
        from importlib.metadata import version as version_of

        typer.echo(version_of("penumbra-render"))
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(ExitCode.USAGE)
