"""The service that a command talks to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

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
