"""Pictures over HTTP: partial, final, cached, in pieces."""

from __future__ import annotations

import io
from pathlib import Path

import httpx2
import numpy as np
import pytest
from PIL import Image

import renderer
from renderer.images.files import encode_layer
from schemas.tiles import Pass, Tile
from service.jobs.bands import Finished
from service.storage.database.models import RenderRow
from service.storage.folder import Folder
from service.storage.tiles import StoredTile, TileStore
from tests.service.support import finish, image, long_scene, scene, submit, wait

KINDS = pytest.mark.parametrize("kind", ["png", "npy"])


@pytest.fixture
def done(client: httpx2.Client) -> str:
    job = submit(client, scene())
    finish(client, job)
    return job


def test_a_picture_is_there_while_it_is_being_rendered(client: httpx2.Client) -> None:
    job = submit(client, long_scene())
    wait(client, job, lambda found: found["last_seq"] > 0)
    answer = client.get(f"/v1/jobs/{job}/image.png")
    assert answer.status_code == 200
    assert 0 < float(answer.headers["X-Progress"]) < 1
    assert client.get(f"/v1/jobs/{job}/image.npy").headers["ETag"] != answer.headers["ETag"]
    partial = image(client, job)
    client.delete(f"/v1/jobs/{job}")
    assert partial.shape == (256, 256, 3)
    # The preview already shows the scene: on average it is right.
    few = renderer.render(renderer.compile_scene(long_scene() | {"sampling": {}}), workers=1).image
    assert abs(float(partial.mean()) - float(few.mean())) < 0.1 * float(few.mean())


@KINDS
def test_the_tag_of_a_final_picture_stays(client: httpx2.Client, done: str, kind: str) -> None:
    first, second = (client.get(f"/v1/jobs/{done}/image.{kind}") for _ in range(2))
    assert first.headers["ETag"] == second.headers["ETag"]
    assert not first.headers["ETag"].startswith("W/")
    assert first.content == second.content
    assert first.headers["X-Progress"] == "1.0000"


@pytest.mark.parametrize(("width", "size"), [(96, (80, 48)), (384, (80, 48))])
def test_a_small_picture_stays_as_it_is(
    client: httpx2.Client, done: str, width: int, size: tuple[int, int]
) -> None:
    answer = client.get(f"/v1/jobs/{done}/image.png", params={"width": width})
    assert Image.open(io.BytesIO(answer.content)).size == size


def test_a_thumbnail_is_the_mean_of_what_is_shown(client: httpx2.Client) -> None:
    job = submit(client, scene(192, 64, samples=1, light_samples=1))
    finish(client, job)
    path = f"/v1/jobs/{job}/image.png"
    whole, small = (client.get(path, params=params) for params in ({}, {"width": 96}))
    codes = np.asarray(Image.open(io.BytesIO(whole.content)), float)
    means = codes.reshape(32, 2, 96, 2, 3).mean(axis=(1, 3))
    # Means are rounded along one side, and then along the other.
    assert np.abs(np.asarray(Image.open(io.BytesIO(small.content)), float) - means).max() <= 1
    assert small.headers["ETag"] != whole.headers["ETag"]
    again = client.get(path, params={"width": 96}, headers={"If-None-Match": small.headers["ETag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert client.get(path, params={"width": 97}).status_code == 422


@KINDS
@pytest.mark.parametrize("form", ["{}", 'W/{}, "other"', '"other", {}'])
def test_a_known_picture_is_not_sent_again(client: httpx2.Client, done: str, kind: str, form: str) -> None:
    path = f"/v1/jobs/{done}/image.{kind}"
    tag = client.get(path).headers["ETag"]
    answer = client.get(path, headers={"If-None-Match": form.format(tag)})
    assert (answer.status_code, answer.content) == (304, b"")
    assert client.get(path, headers={"If-None-Match": '"other"'}).status_code == 200


@KINDS
@pytest.mark.parametrize(
    ("asked", "part"), [("0-9", slice(10)), ("20-", slice(20, None)), ("-7", slice(-7, None))]
)
def test_a_part_of_a_picture(client: httpx2.Client, done: str, kind: str, asked: str, part: slice) -> None:
    path = f"/v1/jobs/{done}/image.{kind}"
    answer = client.get(path, headers={"Range": f"bytes={asked}"})
    assert answer.status_code == 206
    assert answer.content == client.get(path).content[part]


@KINDS
@pytest.mark.parametrize(
    "headers",
    [
        {"Range": "lines=1-2"},
        {"Range": "lines=x"},
        {"Range": "0-9"},
        {"Range": ""},
        {"Range": "bytes=0-9,20-29"},
        {"Range": "bytes=0-3,5-2"},
        {"Range": "bytes=" + "0-1," * 50 + "5-6"},
        {"Range": "bytes=0-9", "If-Range": '"other"'},
        {"Range": "bytes=99999999-", "If-Range": '"other"'},
        {"Range": "bytes=0-9", "If-Range": "Wed, 21 Oct 2015 07:28:00 GMT"},
    ],
    ids=str,
)
def test_a_range_that_does_not_count_gets_the_whole(
    client: httpx2.Client, done: str, kind: str, headers: dict[str, str]
) -> None:
    path = f"/v1/jobs/{done}/image.{kind}"
    answer = client.get(path, headers=headers)
    assert (answer.status_code, answer.content) == (200, client.get(path).content)


@pytest.mark.parametrize("asked", ["Bytes=0-9", "bytes= 0-9 , ,"])
def test_a_range_may_be_written_with_blanks_and_empty_members(
    client: httpx2.Client, done: str, asked: str
) -> None:
    path = f"/v1/jobs/{done}/image.npy"
    answer = client.get(path, headers={"Range": asked})
    assert (answer.status_code, answer.content) == (206, client.get(path).content[:10])


def test_a_range_of_a_head_does_not_count(client: httpx2.Client, done: str) -> None:
    path = f"/v1/jobs/{done}/image.npy"
    answer = client.head(path, headers={"Range": "bytes=0-9"})
    assert answer.status_code == 200
    assert answer.headers["Content-Length"] == str(len(client.get(path).content))


@pytest.mark.parametrize("asked", ["bytes=99999999-", "bytes=5-2", "bytes=-0", "bytes=x", "bytes=", "bytes"])
def test_bytes_that_are_not_there_are_a_problem(client: httpx2.Client, done: str, asked: str) -> None:
    answer = client.get(f"/v1/jobs/{done}/image.npy", headers={"Range": asked})
    assert answer.status_code == 416
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert answer.headers["Content-Range"].startswith("bytes */")


def test_the_head_of_a_picture_has_no_body(client: httpx2.Client, done: str) -> None:
    head, body = client.head(f"/v1/jobs/{done}/image.png"), client.get(f"/v1/jobs/{done}/image.png")
    assert head.content == b""
    assert head.headers["ETag"] == body.headers["ETag"]
    assert int(head.headers["Content-Length"]) == len(body.content)


def test_a_file_for_numpy_is_float32_linear(client: httpx2.Client, done: str) -> None:
    pixels = image(client, done)
    assert (pixels.dtype, pixels.shape) == (np.float32, (48, 80, 3))


def rows_of(finished: Finished, store: TileStore) -> tuple[np.ndarray, np.ndarray, int]:
    """A picture and its depths put together of their bands, and the number of these."""
    pixels, sheets = zip(*finished.bands(store, ["depth"]), strict=True)
    return np.concatenate(pixels), np.concatenate([sheet["depth"] for sheet in sheets]), len(pixels)


WIDE, HIGH, STRIDE = 600, 1000, 8


@pytest.mark.parametrize("merges", [[], [{"attempt": 1}]])
def test_a_large_picture_comes_in_bands_with_every_tile_in_its_place(
    tmp_path: Path, merges: list[dict[str, int]]
) -> None:
    """600,000 pixels are more than a band has; tiles lie at the top, in the middle and at the end."""
    random = np.random.default_rng(4)
    store = TileStore(Folder(tmp_path))
    store.put_spec("job", b"{}")
    coarse = random.random((HIGH // STRIDE, WIDE // STRIDE, 3), np.float32)
    expected = coarse.repeat(STRIDE, axis=0).repeat(STRIDE, axis=1)
    depths = np.full((HIGH, WIDE), np.inf, np.float32)
    whole, rough, fine = Tile(0, 0, 0, WIDE, HIGH), Pass(0, STRIDE, 0, 1), Pass(1, 1, 0, 1)
    preview = StoredTile(whole, rough, 1, store.put_tile("job", whole, rough, 1, coarse))
    if merges:
        store.put_map("job", 0, 1, "picture", expected)
    parts = []
    for tile in (Tile(0, 0, 0, 64, 64), Tile(1, 536, 500, 600, 564), Tile(2, 64, 960, 128, 1000)):
        there = slice(tile.y0, tile.y1), slice(tile.x0, tile.x1)
        depths[there] = random.random(depths[there].shape, np.float32)
        expected[there] = random.random(expected[there].shape, np.float32)
        store.put_layers("job", tile, fine, 1, {"depth": depths[there]})
        parts.append(StoredTile(tile, fine, 1, store.put_tile("job", tile, fine, 1, expected[there])))
    render = RenderRow(id="job", width=WIDE, height=HIGH, merges=merges)
    render.target_error = 0.01 if merges else None
    partial = rows_of(Finished("job", render, preview, tuple(parts), tuple(parts)), store)
    for name, values in (("image", expected), ("layer-depth", depths)):
        store.put_final("job", 1, f"{name}.npy", encode_layer(values))
    render.image_sha256, render.final_prefix = "0" * 64, "1-"
    for pixels, sheet, bands in (partial, rows_of(Finished("job", render), store)):
        np.testing.assert_array_equal(pixels, expected)
        np.testing.assert_array_equal(sheet, depths)
        assert bands > 1
