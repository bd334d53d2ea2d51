"""Files of unfinished pictures that change or go are rendered again, with the same bytes at the end."""

import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import anyio
import httpx2
import numpy as np
import pytest

import renderer
from schemas.api.batches import FLOAT32
from schemas.quality import TargetQuality
from service.client.batches import decode_batch
from service.jobs.tile_events import pixel_batch
from service.jobs.verification import verify
from service.settings import Settings
from service.storage.database.connection import Database
from service.storage.folder import Folder
from service.storage.tiles import TileStore
from tests.service.in_process import in_process
from tests.service.support import TIMEOUT, finish, image, job_of, scene, steps, submit, until, work
from tests.service.test_damaged_files import HARMS, change

pytestmark = pytest.mark.slow

ERROR = 0.0008
LAYERS = ["depth"]


def asked(data: Path, disturb: Callable[[httpx2.Client], None]) -> None:
    """Have a service run while it is asked, and stop it."""
    settings = Settings(data=data, workers=2, tile_size=32, log_level="error")
    with in_process(settings) as local, local.client(timeout=TIMEOUT) as client:
        disturb(client)


def interrupted(data: Path, document: dict[str, Any], is_far: Callable[[], bool], **request: Any) -> Path:
    """Begin a job, stop the service when it has come far enough, and return the folder of its tiles."""
    jobs = []

    def disturb(client: httpx2.Client) -> None:
        jobs.append(submit(client, document, layers=LAYERS, **request))
        until(is_far, TIMEOUT)

    asked(data, disturb)
    return data / "jobs" / jobs[0] / "tiles"


def check_finished(client: httpx2.Client, job: str, expected: renderer.RenderResult) -> None:
    """The picture, its layer and its events are those of an undisturbed job."""
    finish(client, job)
    assert image(client, job).tobytes() == expected.image.tobytes()
    depth = np.load(io.BytesIO(client.get(f"/v1/jobs/{job}/layers/depth.npy").content))
    assert depth.tobytes() == expected.layers["depth"].tobytes()
    batch = client.get(f"/v1/jobs/{job}/tiles").json()
    numbers = [event["seq"] for event in batch["events"]]
    assert numbers == sorted(set(numbers))
    assert batch["complete"]
    assert job_of(client, job)["damage"] is None


def done(data: Path, pass_index: int) -> list[int]:
    """The finished tiles of a pass."""
    rows = steps(data).items()
    return [tile for (index, tile), step in rows if (index, step["state"]) == (pass_index, "done")]


@pytest.fixture(scope="module")
def fixed() -> renderer.RenderResult:
    return renderer.render(renderer.compile_scene(work(), layers=LAYERS), workers=2)


@pytest.mark.parametrize("suffix", ["", ".npz"], ids=["pixels", "layers"])
def test_damaged_tiles_are_rendered_again(tmp_path: Path, fixed: renderer.RenderResult, suffix: str) -> None:
    tiles = interrupted(tmp_path, work(), lambda: len(done(tmp_path, 1)) > len(HARMS))
    for tile, harm in zip(done(tmp_path, 1), HARMS.values(), strict=False):
        harm(tiles / f"1-{tile}.1{suffix}")
    asked(tmp_path, lambda client: check_finished(client, tiles.parent.name, fixed))


@pytest.mark.parametrize("name", ["image.png", "tiles", "layers/depth.npy"])
def test_partial_picture_lacks_a_damaged_tile(
    tmp_path: Path, fixed: renderer.RenderResult, name: str
) -> None:
    tiles = interrupted(tmp_path, work(), lambda: len(done(tmp_path, 1)) > 2)
    job, suffix = tiles.parent.name, ".npz" if "layers" in name else ""
    for tile in done(tmp_path, 1)[:2]:
        change(tiles / f"1-{tile}.1{suffix}")

    def disturb(client: httpx2.Client) -> None:
        answer = client.get(f"/v1/jobs/{job}/{name}", headers={"Accept": "application/octet-stream"})
        assert answer.status_code == 200, answer.text
        check_finished(client, job, fixed)

    asked(tmp_path, disturb)


class Overtaken(Folder):
    """A folder in which something happens before tiles are read that a request has chosen."""

    def __init__(self, folder: Path, happen: Callable[[], None]) -> None:
        super().__init__(folder)
        self._happen = happen

    def many(self, names: Sequence[str]) -> Iterator[bytes]:
        self._happen()
        return super().many(names)


@pytest.mark.parametrize("is_cancelled", [False, True], ids=["finished", "cancelled"])
@pytest.mark.parametrize("quality", [None, {"mode": "target", "error": ERROR}], ids=["fixed", "target"])
def test_job_that_ends_while_its_tiles_are_read_is_whole(
    tmp_path: Path, quality: dict[str, Any] | None, is_cancelled: bool
) -> None:
    settings = Settings(data=tmp_path, workers=2, tile_size=32, log_level="error")
    document = scene(128, 96) if quality else work()
    with in_process(settings) as local, local.client(timeout=TIMEOUT) as client:
        job = submit(client, document, **({"quality": quality} if quality else {}))
        until(lambda: bool(done(tmp_path, 1)), TIMEOUT)
        states = []

        def end() -> None:
            states.append(job_of(client, job)["state"])
            if is_cancelled:
                client.post(f"/v1/jobs/{job}/cancel")
            else:
                finish(client, job)
            until(lambda: not any((tmp_path / "jobs" / job / "tiles").glob("*")))

        late = replace(local.service, store=TileStore(Overtaken(tmp_path / "jobs", end)))
        batch = anyio.run(anyio.to_thread.run_sync, partial(pixel_batch, late, job, 0, FLOAT32))
        news = decode_batch(batch.read(0, batch.size))
        assert states[0] == "running"
        assert news.complete
        assert news.succeeded is not is_cancelled
        assert job_of(client, job)["damage"] is None
        if not is_cancelled:
            expected = image(client, job)
            canvas = np.full_like(expected, np.nan)
            for tile in news.tiles:
                tile.paint(canvas)
            np.testing.assert_array_equal(canvas, expected)


@pytest.fixture(scope="module")
def adaptive() -> renderer.RenderResult:
    target = TargetQuality(mode="target", error=ERROR)
    return renderer.render(renderer.compile_scene(scene(128, 96), target, layers=LAYERS), workers=2)


@pytest.mark.parametrize(
    ("kinds", "harm"),
    [
        (["state"], change),
        (["state", "levels", "picture"], Path.unlink),
        (["levels"], change),
        (["picture"], change),
        (["samples", "layers"], change),
        (["samples", "layers"], Path.unlink),
    ],
    ids=["state", "all", "levels", "picture", "samples", "no samples"],
)
def test_what_a_pass_has_left_is_made_again(
    tmp_path: Path, adaptive: renderer.RenderResult, kinds: list[str], harm: Callable[[Path], object]
) -> None:
    quality = {"mode": "target", "error": ERROR}
    # Tile 0 is a merged pass.
    tiles = interrupted(
        tmp_path, scene(128, 96), lambda: 0 in done(tmp_path, 1) and bool(done(tmp_path, 2)), quality=quality
    )
    merged = max(index for index, tile in steps(tmp_path) if tile == 0)
    names = {"samples": f"{merged + 1}-*.samples", "layers": "0-*.npz"}
    for kind in kinds:
        harm(min(tiles.glob(names.get(kind, f"{merged}-{kind}.*"))))
    asked(tmp_path, lambda client: check_finished(client, tiles.parent.name, adaptive))


def test_files_of_an_unfinished_picture_are_verified(tmp_path: Path) -> None:
    quality = {"mode": "target", "error": ERROR}
    interrupted(
        tmp_path, scene(128, 96), lambda: 0 in done(tmp_path, 1) and bool(done(tmp_path, 2)), quality=quality
    )
    database, place = Database(Settings(data=tmp_path).database_url), Folder(tmp_path)
    files = {file.name: file.is_whole for file in verify(database, place)}
    assert all(files.values())
    kinds = {name.rpartition("/")[2].partition("-")[2].partition(".")[0] for name in files}
    assert {"state", "levels", "picture"} <= kinds
    assert {name.rpartition(".")[2] for name in files} >= {"npz", "samples", "json"}
    for name in files:
        change(tmp_path / name)
    assert {file.name: file.is_whole for file in verify(database, place)} == dict.fromkeys(files, False)
    database.close()
