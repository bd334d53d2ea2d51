"""The table of commands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import typer

from service.cli import (
    compare,
    completion,
    convert,
    demo,
    doctor,
    explain,
    grade,
    jobs,
    keys,
    logs,
    quote,
    render,
    retention,
    serve,
    study,
    submit,
    trace,
    validate,
    watch,
)
from service.cli.exits import ExitCode

COMMANDS: tuple[tuple[str, str, Callable[..., Any]], ...] = (
    ("render", "On this machine", render.render),
    ("validate", "On this machine", validate.validate),
    ("explain", "On this machine", explain.explain),
    ("quote", "On this machine", quote.quote),
    ("trace", "On this machine", trace.trace),
    ("study", "On this machine", study.study),
    ("compare", "On this machine", compare.compare),
    ("convert", "On this machine", convert.convert),
    ("grade", "On this machine", grade.grade),
    ("serve", "Service", serve.serve),
    ("demo", "Service", demo.demo),
    ("doctor", "Service", doctor.doctor),
    ("completion", "Service", completion.completion),
    ("prune", "Service", retention.prune),
    ("submit", "Client", submit.submit),
    ("wait", "Client", watch.wait),
    ("watch", "Client", watch.watch),
    ("get", "Client", jobs.get),
    ("cancel", "Client", jobs.cancel),
    ("delete", "Client", jobs.delete),
    ("pause", "Client", jobs.pause),
    ("resume", "Client", jobs.resume),
    ("ls", "Client", jobs.ls),
    ("logs", "Client", logs.logs),
    ("pin", "Client", retention.pin),
    ("unpin", "Client", retention.unpin),
)


def application() -> typer.Typer:
    """The command line with all its commands."""
    app = typer.Typer(
        help="Ray-traced scenes: rendered here, or by a service that sends back tile after tile.",
        epilog="Exit codes: 0 done, 1 a check found wrong answers, 2 usage, 3 scene or image not usable, "
        "4 server or network, 5 time-out, 130 interrupted.",
        add_completion=False,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback(invoke_without_command=True)(_before_any_command)
    for name, panel, function in COMMANDS:
        app.command(name, rich_help_panel=panel)(function)
    app.add_typer(keys.app, name="keys", rich_help_panel="Service")
    return app


def run(words: Sequence[str]) -> int:
    """Run one command and give its exit code; what goes wrong is raised."""
    completion.prepare()
    code: int | None = application()(list(words), prog_name=completion.COMMAND, standalone_mode=False)
    return code or ExitCode.DONE


def _before_any_command(
    context: typer.Context,
    version: bool = typer.Option(False, "--version", help="Print the version and leave."),
) -> None:
    if version:
        from importlib.metadata import version as version_of

        typer.echo(version_of("penumbra-render"))
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(ExitCode.USAGE)
