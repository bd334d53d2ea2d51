"""The service that a command talks to, and the options that name it, its jobs and their labels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.errors import CommandError

if TYPE_CHECKING:
    from service.client import Client

ServerOption = Annotated[
    str, typer.Option("--server", envvar="PENUMBRA_SERVER", help="Address of the service.")
]
TimeoutOption = Annotated[
    float | None,
    typer.Option("--timeout", min=0, help="Seconds to wait at most; the job goes on after them."),
]


def named(ids: str | list[str]) -> str | list[str]:
    """Give ids back; an empty one would be the address of the list of all jobs."""
    if "" in ([ids] if isinstance(ids, str) else ids):
        # As in `penumbra wait "$JOB"` after a submission that failed.
        raise typer.BadParameter("It is empty. Did the command fail that should have printed the id?")
    return ids


JobArgument = Annotated[
    str, typer.Argument(metavar="ID", help="The job's id.", show_default=False, callback=named)
]
JobsArgument = Annotated[
    list[str], typer.Argument(metavar="ID...", help="The jobs' ids.", show_default=False, callback=named)
]

# Written down twice so that `penumbra --help` need not load the client; a test compares the two.
DEFAULT_SERVER = "http://127.0.0.1:8000"

SHORT_PATIENCE = 1.0
LONG_PATIENCE = 30.0


def connect(server: str, *, patience: float = SHORT_PATIENCE) -> Client:
    """A client for the service at this address.

    Parameters
    ----------
    patience
        Seconds over which requests are repeated while the server is away; waiting for a job outlasts its
        restart.
    """
    from service.client import Client

    return Client(server, patience=patience)


LabelOption = Annotated[
    list[str] | None,
    typer.Option("--label", metavar="NAME:VALUE", help="A label of the job; may be given several times."),
]


def parsed_labels(given: Sequence[str] | None) -> dict[str, str]:
    """Names and values of the options; CommandError where one of them has no colon.

    >>> parsed_labels(["course:cs171", "at:12:30"])
    {'course': 'cs171', 'at': '12:30'}
    """
    pairs = [text.partition(":") for text in given or ()]
    for name, colon, value in pairs:
        if not (name and colon):
            raise CommandError(f"--label {name}{colon}{value} has no name. Write it like course:cs171.")
    return {name: value for name, _, value in pairs}
