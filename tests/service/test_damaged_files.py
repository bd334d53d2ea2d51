"""Stored files that change or go: no wrong byte is sent or rendered, and what is lost is rendered again."""

import hashlib
import itertools
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2
import pytest
from sqlalchemy import select, text

from service.storage.database.models import JobRow, RenderRow
from tests.service.conftest import typical
from tests.service.in_process import InProcess, in_process
from tests.service.processes import held, workers_of
from tests.service.support import finish, image, job_of, scene, submit, wait

SEEDS = itertools.count(100)
MESH = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
BINARY = {"Accept": "application/octet-stream"}


@dataclass(frozen=True)
class Place:
    """A service in this process, its files and who asks it."""

    service: InProcess
    data: Path
    client: httpx2.Client

    def render(self, job: str) -> RenderRow:
        with self.service.service.database.reading() as session:
            row = session.scalars(select(JobRow).where(JobRow.id == job)).one()
            assert row.render is not None
            return row.render

    def file(self, job: str, name: str) -> Path:
        """A final file of a job."""
        render = self.render(job)
        return self.data / "jobs" / render.id / f"{render.final_prefix}{name}"

    def send(self, document: dict[str, Any], **request: Any) -> str:
        """Submit a job that may share a picture."""
        answer = self.client.post("/v1/jobs", json={"scene": document, **request})
        assert answer.status_code == 202, answer.text
        return answer.json()["id"]

    def rendered(self, width: int = 32, **request: Any) -> tuple[dict[str, Any], str]:
        """A picture like no other."""
        document = scene(width, 24, samples=4)
        document["sampling"]["seed"] = next(SEEDS)
        finish(self.client, job := self.send(document, **request))
        return document, job


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Place]:
    data = tmp_path_factory.mktemp("damaged")
    with in_process(typical(data, workers=1)) as made, made.client() as client:
        yield Place(made, data, client)


def change(path: Path, at: int | None = None) -> None:
    """Change a byte, by default in the middle."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2 if at is None else at] ^= 1
    path.write_bytes(content)


HARMS: dict[str, Callable[[Path], object]] = {
    "changed": change,
    "half": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "hundred bytes": lambda path: path.write_bytes(path.read_bytes()[:100]),
    "empty": lambda path: path.write_bytes(b""),
    "gone": Path.unlink,
}
"""Ways to damage a file."""
harms = pytest.mark.parametrize("harm", HARMS.values(), ids=HARMS)


def refused(answer: httpx2.Response) -> bool:
    return answer.status_code == 410 and answer.json()["code"] == "picture_damaged"


@harms
@pytest.mark.parametrize("asked", ["image.npy", "image.png", "image.exr", "tiles"])
def test_damaged_picture_is_gone_and_rendered_for_the_next(
    place: Place, harm: Callable[[Path], object], asked: str
) -> None:
    document, job = place.rendered()
    before = image(place.client, job)
    harm(place.file(job, "image.npy"))
    answer = place.client.get(f"/v1/jobs/{job}/{asked}", headers=BINARY)
    assert refused(answer), answer.text
    assert "Submit the job again" in answer.json()["detail"]
    described = job_of(place.client, job)
    assert described["state"] == "succeeded"
    assert "image.npy" in described["damage"]
    again = place.send(document)
    assert job_of(place.client, again)["state"] != "succeeded"
    finish(place.client, again)
    assert image(place.client, again).tobytes() == before.tobytes()
    assert place.send(document) != again
    assert refused(place.client.get(f"/v1/jobs/{job}/image.npy"))


@pytest.mark.parametrize("name", ["image.npy", "layer-depth.npy"])
def test_picture_whose_file_is_gone_is_not_shared(place: Place, name: str) -> None:
    document, job = place.rendered(layers=["depth"])
    place.file(job, name).unlink()
    again = place.send(document, layers=["depth"])
    assert job_of(place.client, again)["state"] != "succeeded"
    finish(place.client, again)
    assert place.file(again, name).exists()
    assert name in job_of(place.client, job)["damage"]


@harms
def test_damaged_layer_leaves_the_picture(place: Place, harm: Callable[[Path], object]) -> None:
    document, job = place.rendered(layers=["depth"])
    harm(place.file(job, "layer-depth.npy"))
    assert refused(place.client.get(f"/v1/jobs/{job}/layers/depth.npy"))
    assert refused(place.client.get(f"/v1/jobs/{job}/image.exr"))
    assert place.client.get(f"/v1/jobs/{job}/image.npy").status_code == 200
    assert job_of(place.client, place.send(document, layers=["depth"]))["state"] != "succeeded"


@harms
@pytest.mark.parametrize("asked", ["image.png", "image.exr", "image.png?width=96"])
def test_damaged_encoding_is_made_again(place: Place, harm: Callable[[Path], object], asked: str) -> None:
    _, job = place.rendered(width=128)
    path = f"/v1/jobs/{job}/{asked}"
    before = place.client.get(path)
    name = "image-96.png" if "?" in asked else asked
    harm(place.file(job, name))
    after = place.client.get(path)
    assert (after.status_code, after.content == before.content) == (200, True)
    assert place.file(job, name).read_bytes() == before.content
    assert job_of(place.client, job)["damage"] is None


@pytest.mark.slow
def test_range_is_checked_without_the_rest(place: Place) -> None:
    document = scene(480, 400, samples=1, light_samples=1)
    # Little more than the background.
    document["camera"]["look_at"] = [0, 9, 6]
    finish(place.client, job := place.send(document))
    path, size = f"/v1/jobs/{job}/image.npy", place.file(job, "image.npy").stat().st_size
    whole = place.client.get(path).content
    assert size > 2 << 20
    for begin, end in ((0, 10), (1_000_000, 1_100_000), ((1 << 20) - 1, (1 << 20) + 1), (size - 9, size)):
        answer = place.client.get(path, headers={"Range": f"bytes={begin}-{end - 1}"})
        assert (answer.status_code, answer.content) == (206, whole[begin:end])
    change(place.file(job, "image.npy"), at=-1)
    assert refused(place.client.get(path))
    assert place.client.get(path, headers={"Range": "bytes=0-99"}).content == whole[:100]
    assert refused(place.client.get(path, headers={"Range": "bytes=-9"}))


def test_picture_of_an_earlier_version_is_checked_by_its_hash(place: Place) -> None:
    _, job = place.rendered()
    with place.service.service.database.writing() as session:
        session.execute(text("UPDATE renders SET checksums = NULL WHERE id = :id"), {"id": job})
    assert place.client.get(f"/v1/jobs/{job}/image.npy").status_code == 200
    assert place.client.get(f"/v1/jobs/{job}/image.png").status_code == 200
    change(place.file(job, "image.npy"))
    assert refused(place.client.get(f"/v1/jobs/{job}/image.npy"))


def test_damaged_picture_cannot_be_compared(place: Place) -> None:
    _, job = place.rendered()
    change(place.file(job, "image.npy"))
    answer = place.client.post("/v1/comparisons", json={"image": {"job": job}, "reference": {"job": job}})
    assert (answer.status_code, answer.json()["errors"][0]["pointer"]) == (422, "/image")
    assert "damaged" in answer.json()["errors"][0]["detail"]


def uploaded(place: Place) -> tuple[str, bytes]:
    """Upload a mesh like no other."""
    content = MESH + f"# {next(SEEDS):200}\n".encode()
    name = hashlib.sha256(content).hexdigest()
    assert place.client.put(f"/v1/assets/{name}", content=content).status_code == 200
    return name, content


def with_mesh(name: str) -> dict[str, Any]:
    document = scene(32, 24, samples=1)
    document["shapes"].append({"type": "mesh", "asset": f"sha256:{name}", "material": "ball"})
    return document


@harms
def test_damaged_asset_is_neither_sent_nor_rendered(place: Place, harm: Callable[[Path], object]) -> None:
    for asked in ({}, {"Range": "bytes=0-3"}):
        name, content = uploaded(place)
        path = f"/v1/assets/{name}"
        assert place.client.get(path, headers=asked).content in (content, content[:4])
        harm(place.data / "assets" / name)
        for _ in range(2):
            answer = place.client.get(path, headers=asked)
            assert (answer.status_code, answer.json()["code"]) == (404, "unknown_asset")
        refusal = place.client.post("/v1/jobs", json={"scene": with_mesh(name)})
        assert refusal.status_code == 422
        assert refusal.json()["errors"][0]["code"] == "unknown_asset"
        assert place.client.put(path, content=content).status_code == 200
        assert place.client.get(path).content == content


def test_job_with_a_damaged_asset_fails_until_it_is_uploaded_again(place: Place) -> None:
    name, content = uploaded(place)
    change(place.data / "assets" / name)
    job = place.send(with_mesh(name))
    failed = wait(place.client, job, lambda found: found["state"] == "failed")
    assert "Upload it again" in failed["failure"]["message"]
    assert place.client.head(f"/v1/assets/{name}").status_code == 404
    place.client.put(f"/v1/assets/{name}", content=content).raise_for_status()
    finish(place.client, place.send(with_mesh(name)))


@harms
@pytest.mark.parametrize("private", [False, True], ids=["shared", "private"])
def test_damaged_request_fails_its_job(place: Place, harm: Callable[[Path], object], private: bool) -> None:
    document = scene(32, 24, samples=1)
    document["sampling"]["seed"] = next(SEEDS)
    send = submit if private else lambda _, document: place.send(document)
    with held(*workers_of(os.getpid())):
        job = send(place.client, document)
        harm(place.data / "jobs" / job / "spec.json")
    failed = wait(place.client, job, lambda found: found["state"] == "failed")
    assert (failed["failure"]["code"], failed["failure"]["retryable"]) == ("request_damaged", True)
    finish(place.client, send(place.client, document))
