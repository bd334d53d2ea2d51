"""Pictures as large as the service takes them: a client that asks for them does not take its memory."""

import io
import resource
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import httpx2
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from sqlalchemy import update

from renderer.images import files as image_files
from schemas.scene import Display
from service.lifecycle.rows import documents_of
from service.server import RunningServer, running
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.database.models import RenderRow
from service.storage.folder import Folder
from service.storage.tiles import TileStore
from service.workers.layers import file_name
from tests.service.sending import connected
from tests.service.support import TIMEOUT, finish, image, scene, submit

SIZE = 4096, 2160
SMALL = scene(16, 9, samples=1)
AT_ONCE = 4
ONE_MIB, ALL_MIB, WORKER_MIB = 100, 200, 400
SERVER_BYTES = 1 << 30

Answer = TypeVar("Answer")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    settings = Settings(
        data=tmp_path_factory.mktemp("large"), port=0, workers=1, log_level="error", max_wait_seconds=600
    )
    with running(settings) as started:
        yield started


@pytest.fixture(scope="module")
def client(server: RunningServer) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=server.url, timeout=5 * TIMEOUT) as opened:
        yield opened


@pytest.fixture(scope="module")
def jobs(server: RunningServer, client: httpx2.Client) -> list[str]:
    """Finished jobs whose pictures are exchanged for large ones, which would take minutes to render."""
    found = [
        finish(client, submit(client, SMALL, layers=["depth", "normal"]))["id"] for _ in range(AT_ONCE + 1)
    ]
    width, height = SIZE
    ramp = np.linspace(0, 1, width, dtype=np.float32)
    for number, job in enumerate(found):
        picture = np.empty((height, width, 3), np.float32)
        picture[:] = (ramp * (number + 1) / len(found))[:, None]
        picture += np.linspace(0, 0.1, height, dtype=np.float32)[:, None, None]
        exchange(server, job, picture, {"depth": picture[..., 0], "normal": picture})
    return found


def exchange(
    server: RunningServer, job: str, picture: NDArray[np.float32], layers: Mapping[str, NDArray[Any]]
) -> None:
    """Put another picture in place of that of a finished job."""
    store = TileStore(Folder(server.data / "jobs"))
    kept = dict(store.put_final(job, 1, "image.npy", image_files.encode_npy(picture)))
    for name, sheet in layers.items():
        kept |= store.put_final(job, 1, file_name(name), image_files.encode_layer(sheet))
    height, width = picture.shape[:2]
    database = Database(f"sqlite:///{server.data / 'penumbra.sqlite'}")
    with database.writing() as session:
        large = update(RenderRow).where(RenderRow.id == job)
        session.execute(large.values(width=width, height=height, checksums=documents_of(kept)))
    database.close()


def status(pid: int) -> dict[str, int]:
    """The memory of a process according to the kernel, KiB."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return {line.split(":")[0]: int(line.split()[1]) for line in lines if line.endswith(" kB")}


def measured(server: RunningServer, call: Callable[[], Answer]) -> tuple[Answer, float]:
    """The result of a call, and the server's largest additional memory during it, MiB."""
    before = forget_peak(server.process.pid)
    answer = call()
    return answer, (status(server.process.pid)["VmHWM"] - before) / 1024


def forget_peak(pid: int) -> int:
    """Have the highest use counted anew; return what is in use, KiB."""
    Path(f"/proc/{pid}/clear_refs").write_text("5")
    return status(pid)["VmRSS"]


def test_pictures_take_little_memory_alone_and_together(
    server: RunningServer, client: httpx2.Client, jobs: list[str]
) -> None:
    resource.prlimit(server.process.pid, resource.RLIMIT_DATA, (SERVER_BYTES, SERVER_BYTES))
    first, *others = jobs

    def fetched(job: str) -> bytes:
        answer = client.get(f"/v1/jobs/{job}/image.png")
        assert answer.status_code == 200, answer.text
        return answer.content

    content, added = measured(server, partial(fetched, first))
    assert added <= ONE_MIB
    with ThreadPoolExecutor(AT_ONCE) as pool:
        _, added = measured(server, lambda: list(pool.map(fetched, others)))
    assert added <= ALL_MIB
    answer, added = measured(server, partial(client.get, f"/v1/jobs/{first}/image.exr"))
    assert (answer.status_code, added <= ONE_MIB) == (200, True), added
    codes = np.asarray(Image.open(io.BytesIO(content)))
    np.testing.assert_array_equal(codes, image_files.displayed(image(client, first), Display()))


def test_pictures_that_nobody_waits_for_are_not_encoded(
    server: RunningServer, client: httpx2.Client, jobs: list[str]
) -> None:
    wanted = [(job, width) for width in (96, 192, 384) for job in jobs]
    for job, width in wanted:
        asked = f"GET /v1/jobs/{job}/image.png?width={width} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
        connected(server, asked.encode()).close()
    small = finish(client, submit(client, SMALL))["id"]

    def encoded(name: str) -> int:
        return len(list((server.data / "jobs").glob(f"*/{name}")))

    assert client.get(f"/v1/jobs/{small}/image.png").status_code == 200
    # It passes the large ones.
    assert encoded("*image-*.png") < len(wanted) // 2
    # One that comes last would be encoded after all others.
    assert client.get(f"/v1/jobs/{jobs[-1]}/image.exr").status_code == 200
    assert encoded("*image-*.png") < len(wanted) // 2


def test_comparison_of_noise_takes_little_memory(server: RunningServer, client: httpx2.Client) -> None:
    """Its drawings do not compress, and travel as text."""
    job = finish(client, submit(client, SMALL))["id"]
    # A row is longer than the window of the compression, which would find the reference beside its copy.
    noise = np.random.default_rng(2).random((SIZE[1] // 3, SIZE[0] * 3, 3), np.float32)
    exchange(server, job, noise, {})
    (worker,) = (each["pid"] for each in client.get("/v1/workers").json()["workers"])
    forget_peak(worker)
    sent = {"image": {"job": job}, "reference": {"job": job}, "pictures": True}
    answer = client.post("/v1/comparisons", json=sent)
    assert answer.status_code == 200, answer.text
    assert status(worker)["VmHWM"] / 1024 < WORKER_MIB
