"""The Python client against a running service."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import renderer
from renderer.images.files import decode_exr
from schemas.api.jobs import Job, TileBatch
from service.client import Client, NotFoundError, TimedOutError
from tests.acceptance.conftest import ENVIRONMENT, Server

pytestmark = pytest.mark.slow


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with Client(server.url) as opened:
        yield opened


@pytest.fixture
def job(client: Client, scene_file: Path) -> Job:
    """A job that has its image."""
    return client.wait(client.submit(scene_file).id)


def test_progress_is_reported_while_waiting_and_ends_with_everything(
    client: Client, scene_file: Path
) -> None:
    batches: list[TileBatch] = []
    job = client.wait(client.submit(scene_file).id, on_progress=batches.append)
    shares = [batch.progress.share for batch in batches]
    assert shares == sorted(shares)
    assert shares[-1] == 1
    assert sum(len(batch.events) for batch in batches) == job.progress.total == job.last_seq


def test_tiles_painted_from_batches_are_the_image(client: Client, scene_file: Path) -> None:
    job = client.submit(scene_file)
    canvas = np.zeros((job.height, job.width, 3), np.float32)
    after, complete = 0, False
    while not complete:
        batch = client.tile_pixels(job.id, after=after, wait=10)
        for tile in batch.tiles:
            tile.paint(canvas)
        after, complete = batch.next, batch.complete
    assert np.array_equal(canvas, client.pixels(job.id))


def test_a_stream_of_events_resumes_after_any_number(client: Client, job: Job) -> None:
    numbers = [event.seq for event in client.events(job.id)]
    assert numbers == list(range(1, job.last_seq + 1))
    assert [event.seq for event in client.events(job.id, after=2)] == numbers[2:]


def test_plan_and_traces_are_those_of_the_renderer(client: Client, job: Job, scene_file: Path) -> None:
    plan = renderer.compile_scene(renderer.load_scene(scene_file))
    assert client.explain(scene_file) == client.plan(job.id) == plan.describe()
    origins, directions = [[0, 2, 6], [0, 50, 0]], [[0, -1, -4], [0, 1, 0]]
    here, there = renderer.trace(plan, origins, directions), client.trace(scene_file, origins, directions)
    assert there.shape == tuple(here.shape.tolist())
    assert there.t == (here.t[0], None)
    assert there.visibility[0] == tuple(here.visibility[0].tolist())


def test_layers_come_as_the_arrays_that_the_renderer_makes(client: Client, scene_file: Path) -> None:
    job = client.wait(client.submit(scene_file, layers=["uv", "shape"]).id)
    made = renderer.render(renderer.compile_scene(scene_file, layers=["uv", "shape"])).layers
    for name, values in made.items():
        found = client.layer(job.id, name)
        assert (found.dtype, found.tobytes()) == (values.dtype, values.tobytes())
    assert list(decode_exr(client.picture(job.id, "exr").content)[1]) == ["uv", "shape"]
    with pytest.raises(NotFoundError, match="no such layer"):
        client.layer(job.id, "depth")


def test_a_deleted_job_is_gone(client: Client, job: Job) -> None:
    client.delete(job.id)
    assert job.id not in [listed.id for listed in client.list(limit=100).jobs]


def test_a_time_out_while_waiting_has_the_jobs_id(client: Client, endless_file: Path) -> None:
    job = client.submit(endless_file)
    with pytest.raises(TimedOutError) as caught:
        client.wait(job.id, timeout=0.2)
    assert caught.value.job_id == job.id
    assert client.cancel(job.id).id == job.id


def test_the_convergence_of_a_job_is_reported(client: Client, job: Job) -> None:
    found = client.convergence(job.id)
    assert (found.job, found.state) == (job.id, job.state)
    assert found.passes[-1].rays == job.cost.rays
    assert client.convergence_file(job.id).count(b"\r\n") == 1 + len(found.passes)
    assert client.convergence_file(job.id, "png").startswith(b"\x89PNG")
    with pytest.raises(NotFoundError):
        client.convergence("none")


def test_ctrl_c_ends_the_waiting_and_names_the_job_that_keeps_running(
    client: Client, server: Server, endless_file: Path
) -> None:
    script = (
        "import sys; from service.client import Client; job = Client(sys.argv[1]).submit(sys.argv[2]); "
        "job.wait(on_progress=lambda batch: print(job.id, flush=True))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script, server.url, str(endless_file)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
    ) as waiting:
        assert waiting.stdout is not None
        job_id = waiting.stdout.readline().strip()
        waiting.send_signal(signal.SIGINT)
        _, err = waiting.communicate(timeout=60)
    assert waiting.returncode == -signal.SIGINT
    assert f"client.wait('{job_id}')" in err
    assert client.get(job_id).cancel().state == "cancelled"
