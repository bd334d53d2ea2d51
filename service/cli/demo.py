"""``penumbra demo``: the whole way of a scene, on this machine, in a few seconds."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli import output
from service.cli.connection import connect
from service.cli.errors import CommandError, ServiceStartError
from service.cli.jobs import save_picture
from service.cli.progress import Bar, progress_bar
from service.cli.targets import ImageTarget

if TYPE_CHECKING:
    from schemas.jobs import Job, TileBatch
    from service.server import RunningServer

DEFAULT_OUT = "out/demo.png"
OutOption = Annotated[
    ImageTarget | None,
    typer.Option(
        "-o",
        "--out",
        parser=ImageTarget.named,
        metavar="FILE",
        show_default=DEFAULT_OUT,
        help="Where the picture goes: .png, .npy, or .exr; - or -.npy is stdout.",
    ),
]
SCENE = "basic.json"


def demo(out: OutOption = None, as_json: output.JsonOption = False) -> None:
    """Start a service, render a scene of the gallery over HTTP, save the picture, stop everything."""
    out = out or ImageTarget.named(DEFAULT_OUT)
    _make_folder(out.path.parent)
    out.check(with_layers=False, as_json=as_json)
    with _service() as server, connect(server.url) as client:
        output.say(f"It answers at {server.url}. Submitting {SCENE} from the gallery over HTTP.")
        arrivals = Arrivals()
        job = client.submit(_gallery_scene())
        output.say(f"It is job {job.id}: {job.width} x {job.height} pixels. Its tiles arrive:")
        with progress_bar("rendering") as bar:
            job = client.wait(job.id, on_progress=lambda batch: arrivals.note(batch, bar))
        output.say(arrivals.story(job))
        save_picture(client, job.id, out)
        output.say("Stopping the service and removing its folder.")
    if as_json:
        output.document(
            {
                "out": str(out),
                "seconds": arrivals.last,
                "first_pixels_seconds": arrivals.first,
                "job": job.model_dump(mode="json"),
            }
        )


@dataclass(slots=True)
class Arrivals:
    """When tiles arrived, seconds since the scene was submitted."""

    begun: float = field(default_factory=time.perf_counter)
    first: float | None = None
    last: float = 0.0
    told: int = 0

    def note(self, batch: TileBatch, bar: Bar) -> None:
        """Take note of some tiles and show them."""
        self.last = time.perf_counter() - self.begun
        if self.first is None and batch.events:
            self.first = self.last
        done = batch.progress
        said = f"tile {done.done} of {done.total}"
        bar.show(done.share, said)
        quarters = int(4 * done.share)
        if not bar.visible and quarters > self.told:
            self.told = quarters
            output.say(f"  {said}, {done.share:.0%} of the samples")

    def story(self, job: Job) -> str:
        """What there is to say afterwards."""
        first = "" if self.first is None else f"The first pixels were here after {self.first:.2f} s, "
        rays = sum(job.cost.rays.values())
        return f"{first}all {job.progress.total} tiles after {self.last:.2f} s: {rays:,} rays."


@contextmanager
def _service() -> Iterator[RunningServer]:
    """A service on a free port with a folder of its own; afterwards both are gone."""
    import tempfile

    from service.errors import UnavailableError
    from service.server import running
    from service.settings import Settings

    with tempfile.TemporaryDirectory(prefix="penumbra-demo-") as folder:
        data = Path(folder)
        settings = Settings(data=data, host="127.0.0.1", port=0, database=f"sqlite:///{data / 'demo.sqlite'}")
        output.say(f"Starting a service with {settings.workers} workers on a free port.")
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


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CommandError(f"The folder {folder} cannot be made: {error.strerror}.") from error
