"""``penumbra serve``: the service and its workers, until it is stopped."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from service.cli import output
from service.cli.configuration import ConfigOption, read_settings
from service.cli.errors import ServiceStartError
from service.cli.exits import ExitCode
from service.cli.workers import WorkersOption

Engine = Literal["slots", "dask"]

HostOption = Annotated[str | None, typer.Option(help="Address to listen on; 127.0.0.1 by default.")]
PortOption = Annotated[
    int | None, typer.Option(min=0, max=65535, help="Port; 8000 by default, 0 takes a free one.")
]
DataOption = Annotated[Path | None, typer.Option(help="Folder for everything that is kept.")]
StoreOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="Bucket for pictures and textures, s3://bucket/prefix; else the data folder."
    ),
]
DatabaseOption = Annotated[
    str | None, typer.Option(help="SQLAlchemy URL; by default an SQLite file in the data folder.")
]
EngineOption = Annotated[
    Engine | None, typer.Option(help="What renders: slots, processes of this machine (default), or dask.")
]
DaskOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="Scheduler of the Dask cluster, tls://host:8786; by default one starts here."
    ),
]
ProxyOption = Annotated[
    bool,
    typer.Option("--behind-proxy", help="Ask for no keys: a proxy in front lets in only who may use this."),
]


def serve(  # noqa: PLR0913, PLR0917 - one argument for each option
    host: HostOption = None,
    port: PortOption = None,
    data: DataOption = None,
    store: StoreOption = None,
    workers: WorkersOption = None,
    database: DatabaseOption = None,
    engine: EngineOption = None,
    dask: DaskOption = None,
    behind_proxy: ProxyOption = False,
    config: ConfigOption = None,
) -> None:
    """Run the service. What is not given comes from PENUMBRA_HOST, PENUMBRA_PORT and so on, or a file."""
    from service.server import run

    options: dict[str, Any] = {
        "host": host,
        "port": port,
        "data": data,
        "store": store,
        "workers": workers,
        "database": database,
    }
    options |= {"engine": engine, "dask": dask}
    options["behind_proxy"] = behind_proxy or None
    given = {name: value for name, value in options.items() if value is not None}
    settings = read_settings(given, config=config)
    try:
        run(settings)
    except KeyboardInterrupt:
        output.say("The service has stopped. Jobs that were not done go on when it starts again.")
    except SystemExit as exit_:
        # The server reports what kept it from starting, and leaves by itself.
        if exit_.code not in {ExitCode.TERMINATED, ExitCode.HUNG_UP}:
            raise ServiceStartError("The service could not start. The lines above say why.") from exit_
