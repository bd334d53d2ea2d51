"""``penumbra serve`` and ``demo``: a service on this machine, and the sources of its settings."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from service.cli import output
from service.cli.errors import CommandError, ExitCode, ServiceStartError
from service.cli.jobs import save_picture
from service.cli.options import (
    ConfigOption,
    DatabaseOption,
    DataOption,
    JsonOption,
    WorkersOption,
    connect,
    image_option,
)
from service.cli.progress import Bar, progress_bar
from service.cli.targets import ImageTarget, make_folder
from service.cli.wording import counted, plain

if TYPE_CHECKING:
    from schemas.api.jobs import Job, TileBatch
    from service.server import RunningServer
    from service.settings import Settings


def read_settings(given: Mapping[str, Any], *, config: Path | None = None) -> Settings:
    """The settings with these options; others come from the environment, else from a file.

    Parameters
    ----------
    config
        The settings file, by default the one that ``PENUMBRA_CONFIG`` names.

    Raises
    ------
    CommandError
        They are invalid; the message names each with its variable.
    """
    from pydantic import ValidationError
    from pydantic_settings import SettingsError

    from service.settings import Settings, SettingsFileError

    if config is not None:
        os.environ["PENUMBRA_CONFIG"] = str(config)
    try:
        return Settings.model_validate(given)
    except ValidationError as error:
        found = error.errors(include_url=False, include_input=False)
        raise CommandError(" ".join(map(_setting_error, found))) from error
    except (SettingsError, SettingsFileError) as error:
        raise CommandError(f"{error}.") from error


def _setting_error(item: Mapping[str, Any]) -> str:
    from service.settings import DEFAULT, UNLIMITED, WITHOUT_LIMIT, source_of

    path = tuple(str(part) for part in item["loc"])
    if not path:
        return plain(item["msg"])
    source = source_of(path)
    variable = "PENUMBRA_" + ("__".join(path).upper() or "...")
    name = variable if source in {DEFAULT, variable} else f"{'.'.join(path)} in {source}"
    unknown = item["type"] in {"extra_forbidden", "unexpected_keyword_argument"}
    cure = f" Write {UNLIMITED} for no limit." if path[0] in WITHOUT_LIMIT else ""
    return f"{name}: {'There is no such setting.' if unknown else plain(item['msg']) + cure}"


Engine = Literal["slots", "dask"]


def serve(  # noqa: PLR0913, PLR0917 - one argument for each option
    host: Annotated[str | None, typer.Option(help="Address to listen on; 127.0.0.1 by default.")] = None,
    port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="Port; 8000 by default, 0 picks a free one.")
    ] = None,
    data: DataOption = None,
    store: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Bucket for pictures and textures, s3://bucket/prefix; by default the data folder.",
        ),
    ] = None,
    workers: WorkersOption = None,
    database: DatabaseOption = None,
    engine: Annotated[
        Engine | None,
        typer.Option(
            help="Where tiles are rendered: slots, processes of this machine (the default), or dask."
        ),
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Scheduler of the Dask cluster, tls://host:8786; by default a small cluster starts here.",
        ),
    ] = None,
    behind_proxy: Annotated[
        bool,
        typer.Option(
            "--behind-proxy",
            help="Require no keys, because a proxy in front authenticates users. Needs the settings hosts, "
            "and proxy_user_header or proxy_role.",
        ),
    ] = False,
    config: ConfigOption = None,
) -> None:
    """Run the service, with its web page, until Ctrl-C.

    A setting that no option gives comes from its variable, such as PENUMBRA_PORT, or else from a file.
    """
    options = {
        "host": host,
        "port": port,
        "data": data,
        "store": store,
        "workers": workers,
        "database": database,
        "engine": engine,
        "dask": dask,
        "behind_proxy": behind_proxy or None,
    }
    given = {name: value for name, value in options.items() if value is not None}
    _run(read_settings(given, config=config))


def _run(settings: Settings) -> None:
    if settings.engine == "slots":
        from service.workers.fork_server import fork_server

        fork_server.start()
    from service.server import run

    try:
        run(settings)
    except KeyboardInterrupt:
        output.say("The service has stopped. Unfinished jobs resume when it starts again.")
    except SystemExit as exit_:
        # The server reports why it could not start, and exits.
        if exit_.code not in {ExitCode.TERMINATED, ExitCode.HUNG_UP}:
            raise ServiceStartError("The service could not start. The lines above say why.") from exit_


DEFAULT_OUT = "out/demo.png"
SCENE = "basic.json"


def demo(
    out: Annotated[
        ImageTarget | None, image_option("Where the picture goes", show_default=DEFAULT_OUT)
    ] = None,
    keep: Annotated[
        bool,
        typer.Option("--keep", help="Leave the service running until Ctrl-C, to see the job on its page."),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Render a scene of the gallery over HTTP, to see it all work.

    Starts a service, submits the scene, saves the picture, and stops the service.
    """
    out = out or ImageTarget.named(DEFAULT_OUT)
    make_folder(out.path.parent)
    out.check(as_json=as_json)
    with _temporary_service() as server, connect(server.url) as client:
        output.say(f"It answers at {server.url}. Submitting {SCENE} from the gallery over HTTP.")
        arrivals = Arrivals()
        job = client.submit(_gallery_scene())
        output.say(f"It is job {job.id}: {job.width} x {job.height} pixels. Its tiles arrive:")
        with progress_bar("rendering") as bar:
            job = client.wait(job.id, on_progress=lambda batch: arrivals.show(batch, bar))
        output.say(arrivals.summary(job))
        save_picture(client, job.id, out)
        page = f"{server.url}/jobs/{job.id}"
        if as_json:
            output.document(
                {
                    "out": str(out),
                    "page": page,
                    "seconds": arrivals.last,
                    "first_pixels_seconds": arrivals.first,
                    "job": job.model_dump(mode="json"),
                }
            )
        if keep:
            output.say(f"The page of the job is {page}\nCtrl-C stops the service.")
            _wait_for_interrupt(server)
        output.say("Stopping the service and removing its folder.")
    if not keep:
        output.say(f"The page of the job was {page}\n`penumbra demo --keep` leaves it open.")


def _wait_for_interrupt(server: RunningServer) -> None:
    """Let a service run until Ctrl-C, which is how it is meant to end."""
    from service.errors import UnavailableError

    try:
        code = server.process.wait()
    except KeyboardInterrupt:
        return
    raise UnavailableError(f"The service ended with code {code}.")


@dataclass(slots=True)
class Arrivals:
    """Arrival times of tiles, seconds since the scene was submitted."""

    begun: float = field(default_factory=time.perf_counter)
    first: float | None = None
    last: float = 0.0
    quarters_shown: int = 0

    def show(self, batch: TileBatch, bar: Bar) -> None:
        """Show tiles that have arrived."""
        self.last = time.perf_counter() - self.begun
        if self.first is None and batch.events:
            self.first = self.last
        done = batch.progress
        said = f"tile {done.done} of {done.total}"
        bar.show(done.share, said)
        quarters = int(4 * done.share)
        if not bar.visible and quarters > self.quarters_shown:
            self.quarters_shown = quarters
            output.say(f"  {said}, {100 * done.share:.0f} % of the samples")

    def summary(self, job: Job) -> str:
        """A summary for the end."""
        first = "" if self.first is None else f"The first pixels arrived after {self.first:.2f} s, "
        rays = sum(job.cost.rays.values())
        return f"{first}all {job.progress.total} tiles after {self.last:.2f} s: {rays:,} rays."


@contextmanager
def _temporary_service() -> Iterator[RunningServer]:
    """A service on a free port, with a temporary folder."""
    import tempfile

    from service.errors import UnavailableError
    from service.server import running
    from service.settings import Settings

    with tempfile.TemporaryDirectory(prefix="penumbra-demo-") as folder:
        data = Path(folder)
        settings = Settings(data=data, host="127.0.0.1", port=0, database=f"sqlite:///{data / 'demo.sqlite'}")
        output.say(f"Starting a service with {counted(settings.workers, 'worker')} on a free port.")
        log = data / "log"
        with log.open("wb") as stderr:
            try:
                with running(settings, stderr=stderr) as server:
                    yield server
            except UnavailableError as error:
                raise ServiceStartError(f"{error}\n{log.read_text()}".strip()) from error


def _gallery_scene() -> Path:
    from importlib.resources import files

    return Path(str(files("scenes").joinpath("gallery", SCENE)))
