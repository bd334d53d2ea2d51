"""Options and arguments that several commands share, and the client that ``--server`` asks for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from service.cli.errors import CommandError
from service.cli.targets import ImageTarget

if TYPE_CHECKING:
    from service.client import Client

# Limits are repeated here so that `penumbra --help` need not load the client, the schemas and the settings;
# tests/service/cli/test_startup.py compares them.
DEFAULT_SERVER = "http://127.0.0.1:8000"
LARGEST_SEED = 2**53 - 1
MOST_WORKERS = 1024
PRIORITIES = (-10, 10)
State = Literal["queued", "running", "succeeded", "failed", "cancelled", "expired"]

SHORT_RETRY = 1.0
LONG_RETRY = 30.0
"""Seconds over which requests are repeated while the server is away; waiting for a job outlasts a restart."""


def _not_empty(ids: str | list[str]) -> str | list[str]:
    """Refuse an empty id: its address would be that of the list of jobs."""
    if "" in ([ids] if isinstance(ids, str) else ids):
        # As in `penumbra wait "$JOB"` after a submission that failed.
        raise typer.BadParameter("It is empty. Did the command that prints the id fail?")
    return ids


JobArgument = Annotated[
    str, typer.Argument(metavar="ID", help="The job's id.", show_default=False, callback=_not_empty)
]
JobsArgument = Annotated[
    list[str], typer.Argument(metavar="ID...", help="The jobs' ids.", show_default=False, callback=_not_empty)
]
SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help="A scene file; - reads it from stdin.", show_default=False)
]
ServerOption = Annotated[
    str, typer.Option("--server", envvar="PENUMBRA_SERVER", help="Address of the service.")
]
TimeoutOption = Annotated[
    float | None,
    typer.Option("--timeout", min=0, help="Longest wait in seconds; the job continues."),
]
LabelOption = Annotated[
    list[str] | None,
    typer.Option("--label", metavar="NAME:VALUE", help="A label of the job; repeatable."),
]
LayersOption = Annotated[
    list[str] | None,
    typer.Option(
        "--layers",
        metavar="NAME,NAME",
        help="What to store of each pixel beside its colour: depth, position, normal, shading_normal, "
        "albedo, uv, shape, primitive, samples, error; repeatable. Saved as OUT.NAME.npy, or in OUT if that "
        "is .exr.",
    ),
]
BitsOption = Annotated[
    Literal["8", "16"], typer.Option("--bits", help="Bits of a channel of a .png; .npy and .exr have 32.")
]
SeedOption = Annotated[
    int | None,
    typer.Option(min=0, max=LARGEST_SEED, help="Seed of the random numbers, in place of the scene's."),
]
WorkersOption = Annotated[
    int | None,
    typer.Option(min=1, max=MOST_WORKERS, help="Worker processes; by default one per processor."),
]
ConfigOption = Annotated[
    Path | None,
    typer.Option(
        help="A TOML file of settings; by default the one that PENUMBRA_CONFIG names.", show_default=False
    ),
]
DataOption = Annotated[Path | None, typer.Option(help="Data folder of the service.")]
DatabaseOption = Annotated[
    str | None,
    typer.Option(metavar="URL", help="A PostgreSQL database; by default an SQLite file in the data folder."),
]
JsonOption = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on stdout and nothing else there.")
]


def image_option(use: str, **more: Any) -> Any:
    """The option ``-o`` of a command that writes an image, such as "Save the image"."""
    forms = ".png, .npy for linear float32, or .exr; - or -.npy is stdout."
    parser = ImageTarget.named
    return typer.Option("-o", "--out", parser=parser, metavar="FILE", help=f"{use}: {forms}", **more)


def connect(server: str, *, retry: float = SHORT_RETRY) -> Client:
    """A client for the service at this address, which repeats requests for `retry` seconds."""
    from service.client import Client

    return Client(server, retry_seconds=retry)


def parsed_labels(given: Sequence[str] | None) -> dict[str, str]:
    """Names and values of the options; CommandError if one has no colon, or a name has two values.

    >>> parsed_labels(["course:cs171", "at:12:30"])
    {'course': 'cs171', 'at': '12:30'}
    """
    listed = listed_labels(given)
    for name, values in listed.items():
        if len(values) > 1:
            raise CommandError(f"--label {name} has several values; a job has one of each name.")
    return {name: values[0] for name, values in listed.items()}


def listed_labels(given: Sequence[str] | None) -> dict[str, list[str]]:
    """Names of the options with all their values; CommandError if one has no colon."""
    listed: dict[str, list[str]] = {}
    for name, colon, value in (text.partition(":") for text in given or ()):
        if not (name and colon):
            raise CommandError(f"--label {name}{colon}{value} has no name. Write it like course:cs171.")
        listed.setdefault(name, []).append(value)
    return listed
