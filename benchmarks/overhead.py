"""What the service adds to a render, and how soon its client sees something."""

from __future__ import annotations

import itertools
import json
import statistics
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypedDict

import renderer
from benchmarks.machine import Spread, describe, spread
from benchmarks.references import SCENES
from benchmarks.settings import Setting
from service.client import Client
from service.server import running
from service.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Callable

JOB = Setting("soft", "uniform", 9, "uniform", 64)
"""About two seconds on two cores."""


SEEDS = itertools.count(1)


class Overhead(TypedDict):
    """Wall seconds of the same job on every way, with the same number of workers.

    `command` is `penumbra render`, start of Python and of its workers included; `call` is `renderer.render`
    with workers of its own; `service` is a job sent to a service that is running already, until its linear
    image has arrived. The ratios are service / command and service / call, the middle of those of each turn:
    what slows the machine down for a while slows both down. `first_pixels` is from sending the
    job to having the pixels of its first tile event.
    """

    workers: int
    command: Spread
    call: Spread
    service: Spread
    ratio_to_command: float
    ratio_to_call: float
    first_pixels: Spread


def measure(runs: int) -> Overhead:
    """Run the job `runs` times on every way in turn, after one run that warms the service up."""
    workers = describe()["cores"]
    with (
        TemporaryDirectory() as folder,
        running(Settings(data=Path(folder) / "data", port=0, workers=workers, log_level="error")) as server,
        Client(server.url) as client,
    ):
        _service(client)
        picture = Path(folder) / "picture.npy"
        rounds = [_round(client, picture, workers) for _ in range(runs)]
    command, call, service, first = (spread(seconds) for seconds in zip(*rounds, strict=True))
    return Overhead(
        workers=workers,
        command=command,
        call=call,
        service=service,
        ratio_to_command=round(statistics.median(sent / run for run, _, sent, _ in rounds), 3),
        ratio_to_call=round(statistics.median(sent / called for _, called, sent, _ in rounds), 3),
        first_pixels=first,
    )


def _round(client: Client, picture: Path, workers: int) -> tuple[float, float, float, float]:
    """Every way once: a machine that slows down slows all of them down."""
    return (
        _seconds(lambda: _command(picture, workers)),
        _seconds(lambda: renderer.render(JOB.plan(), workers=workers)),
        _seconds(lambda: _service(client)),
        _first_pixels(client),
    )


def _seconds(action: Callable[[], object]) -> float:
    begun = time.perf_counter()
    action()
    return time.perf_counter() - begun


def _command(picture: Path, workers: int) -> None:
    options = {
        "--samples": JOB.samples,
        "--pattern": JOB.pattern,
        "--light-samples": JOB.light_samples,
        "--light-pattern": JOB.light_pattern,
        "--workers": workers,
        "-o": picture,
    }
    words = [str(word) for pair in options.items() for word in pair]
    command = [sys.executable, "-m", "service.cli.main", "render", str(SCENES / f"{JOB.scene}.json"), *words]
    subprocess.run(command, check=True, capture_output=True)


def _scene() -> dict[str, Any]:
    """Give the scene with a seed of its own: one that was rendered before is answered from the store."""
    document: dict[str, Any] = json.loads((SCENES / f"{JOB.scene}.json").read_text())
    document.setdefault("sampling", {})["seed"] = next(SEEDS)
    return document


def _service(client: Client) -> None:
    job = client.submit(_scene(), quality=JOB.quality.model_dump(mode="json"))
    client.wait(job.id)
    client.pixels(job.id)


def _first_pixels(client: Client) -> float:
    begun = time.perf_counter()
    job = client.submit(_scene(), quality=JOB.quality.model_dump(mode="json"))
    batch = client.tile_pixels(job.id, wait=20.0)
    seconds = time.perf_counter() - begun
    if not batch.tiles:
        raise RuntimeError("The service sent no tile within 20 s.")
    client.cancel(job.id)
    return seconds
