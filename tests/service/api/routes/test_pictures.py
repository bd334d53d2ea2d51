"""Pictures and layers over HTTP: partial, final, cached, in pieces."""

import io
import tempfile
from email.utils import formatdate, parsedate_to_datetime
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from PIL import Image

import renderer
from renderer.images.files import decode_exr
from schemas.api.layers import LAYER_NAMES
from service.server import running
from service.settings import Settings
from tests.service.sending import problem_of
from tests.service.support import TIMEOUT, ended, finish, image, job_of, long_scene, scene, submit, wait

FILES = ["image.png", "image.npy", "image.exr", "layers/depth.npy"]
ALL = list(LAYER_NAMES)


def layer(client: httpx2.Client, job: str, name: str) -> np.ndarray:
    answer = client.get(f"/v1/jobs/{job}/layers/{name}.npy")
    assert answer.status_code == 200, answer.text
    return np.load(io.BytesIO(answer.content))


def opened(answer: httpx2.Response) -> Image.Image:
    assert answer.status_code == 200, answer.text
    return Image.open(io.BytesIO(answer.content))


@pytest.mark.slow
def test_picture_and_layers_are_there_while_they_are_rendered(
    api: httpx2.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A system with a read-only root has no such folder.
    monkeypatch.setattr(tempfile, "tempdir", "/nonexistent")
    document = long_scene()
    job = submit(api, document, layers=["depth", "error"])
    path = f"/v1/jobs/{job}"

    def something_is_seen(_: dict[str, Any]) -> bool:
        found = api.get(f"{path}/layers/depth.npy")
        return found.status_code == 200 and bool(np.isfinite(np.load(io.BytesIO(found.content))).any())

    wait(api, job, something_is_seen)
    png, npy, depth, errors, exr = (
        api.get(f"{path}/{file}")
        for file in ("image.png", "image.npy", "layers/depth.npy", "layers/error.npy", "image.exr")
    )
    running = not ended(job_of(api, job))
    api.delete(path)
    assert running
    assert all(0 < float(answer.headers["X-Progress"]) < 1 for answer in (png, npy, errors))
    assert png.headers["ETag"] != npy.headers["ETag"]
    # Two of them may be of the same second.
    assert "Last-Modified" not in png.headers
    # The preview already shows the scene: on average it is right.
    rough = renderer.compile_scene(document | {"sampling": {}}, layers=["depth"])
    few = renderer.render(rough, workers=1)
    partial = np.load(io.BytesIO(npy.content))
    assert partial.shape == (256, 256, 3)
    assert abs(float(partial.mean()) - float(few.image.mean())) < 0.1 * float(few.image.mean())
    depths = np.load(io.BytesIO(depth.content))
    there = np.isfinite(depths)
    assert there.any()
    assert np.array_equal(depths[there], few.layers["depth"][there])
    assert not np.isnan(np.load(io.BytesIO(errors.content))).any()
    assert list(decode_exr(exr.content)[1]) == ["depth", "error"]


def test_layers_have_the_bytes_that_the_renderer_makes(api: httpx2.Client) -> None:
    job = submit(api, scene(), layers=ALL)
    finish(api, job)
    wanted = renderer.render(renderer.compile_scene(scene(), layers=ALL))
    assert image(api, job).tobytes() == wanted.image.tobytes()
    links = job_of(api, job)["links"]["layers"]
    assert list(links) == ALL
    for name in ALL:
        found = layer(api, job, name)
        assert (found.dtype, found.shape) == (wanted.layers[name].dtype, wanted.layers[name].shape)
        assert found.tobytes() == wanted.layers[name].tobytes(), name


def test_layer_that_was_not_asked_for_is_not_there(api: httpx2.Client, done: str) -> None:
    for name in ("uv", "dept", "..%2Fimage"):
        answer = api.get(f"/v1/jobs/{done}/layers/{name}.npy")
        assert "uv" not in problem_of(answer, 404).get("detail", "")
    bare = submit(api, scene(8, 8))
    assert job_of(api, bare)["links"]["layers"] == {}
    assert problem_of(api.get(f"/v1/jobs/{bare}/layers/depth.npy"), 404)["code"] == "unknown_layer"


def test_exr_file_has_the_picture_and_its_layers(api: httpx2.Client, done: str) -> None:
    pixels, layers = decode_exr(api.get(f"/v1/jobs/{done}/image.exr").content)
    assert pixels.tobytes() == image(api, done).tobytes()
    assert list(layers) == ["depth", "shape"]
    for name, found in layers.items():
        assert found.tobytes() == layer(api, done, name).tobytes()


@pytest.mark.parametrize("file", FILES)
def test_file_is_cached_and_sent_in_parts(api: httpx2.Client, done: str, file: str) -> None:
    path = f"/v1/jobs/{done}/{file}"
    whole, again = api.get(path), api.get(path)
    tag = whole.headers["ETag"]
    assert (whole.content, tag, whole.headers["X-Progress"]) == (
        again.content,
        again.headers["ETag"],
        "1.0000",
    )
    assert not tag.startswith("W/")
    for form in (tag, f'W/{tag}, "other"', f'"other", {tag}', "*"):
        known = api.get(path, headers={"If-None-Match": form})
        assert (known.status_code, known.content) == (304, b""), form
        assert known.headers["Cache-Control"] == "private, no-cache"
    assert api.get(path, headers={"If-None-Match": '"other"'}).status_code == 200
    for asked, part in {"0-9": slice(10), "20-": slice(20, None), "-7": slice(-7, None)}.items():
        answer = api.get(path, headers={"Range": f"bytes={asked}"})
        assert (answer.status_code, answer.content) == (206, whole.content[part]), asked
    head = api.head(path, headers={"Range": "bytes=0-9"})
    assert (head.status_code, head.content, head.headers["ETag"]) == (200, b"", tag)
    assert int(head.headers["Content-Length"]) == len(whole.content)


DAY = 86400
TAG, DATE = "ETag", "Last-Modified"
IN_FORCE: list[tuple[dict[str, str], int]] = [
    ({"If-Match": "{tag}"}, 200),
    ({"If-Match": '"other", {tag}'}, 200),
    ({"If-Match": "*"}, 200),
    ({"If-Match": '"other"'}, 412),
    ({"If-Match": "W/{tag}"}, 412),
    ({"If-Match": '"other"', "Range": "bytes=0-9"}, 412),
    ({"If-Match": '"other"', "If-None-Match": "{tag}"}, 412),
    ({"If-Match": "{tag}", "If-None-Match": "{tag}"}, 304),
    ({"If-Unmodified-Since": "{date}"}, 200),
    ({"If-Unmodified-Since": "{before}"}, 412),
    ({"If-Unmodified-Since": "{before}", "If-Match": "{tag}"}, 200),
    ({"If-Unmodified-Since": "yesterday"}, 200),
    ({"If-Modified-Since": "{date}"}, 304),
    ({"If-Modified-Since": "{after}"}, 304),
    ({"If-Modified-Since": "{before}"}, 200),
    ({"If-Modified-Since": "{date}", "If-None-Match": '"other"'}, 200),
    ({"If-Modified-Since": "yesterday"}, 200),
    ({"Range": "bytes=0-9", "If-Range": "{tag}"}, 206),
    ({"Range": "bytes=0-9", "If-Range": "{date}"}, 206),
    ({"Range": "bytes=0-9", "If-Range": "W/{tag}"}, 200),
    ({"Range": "bytes=0-9", "If-Range": '"other"'}, 200),
    ({"Range": "bytes=0-9", "If-Range": "{before}"}, 200),
    ({"Range": "bytes=0-9", "If-Range": "{tag}", "If-Match": '"other"'}, 412),
]


@pytest.mark.parametrize("file", ["image.npy", "image.png?width=96", "layers/depth.npy"])
@pytest.mark.parametrize(("headers", "status"), IN_FORCE, ids=[" ".join(sent) for sent, _ in IN_FORCE])
def test_condition_decides_the_answer(
    api: httpx2.Client, done: str, file: str, headers: dict[str, str], status: int
) -> None:
    path = f"/v1/jobs/{done}/{file}"
    known = api.get(path).headers
    at = parsedate_to_datetime(known[DATE]).timestamp()
    dates = {"before": formatdate(at - DAY, usegmt=True), "after": formatdate(at + DAY, usegmt=True)}
    sent = {name: text.format(tag=known[TAG], date=known[DATE], **dates) for name, text in headers.items()}
    for method in ("GET", "HEAD"):
        answer = api.request(method, path, headers=sent)
        # A range of a HEAD request is ignored.
        assert answer.status_code == (200 if (status, method) == (206, "HEAD") else status), method
    if status == 412:
        assert problem_of(api.get(path, headers=sent), 412)["code"] == "precondition_failed"


def test_header_may_come_in_several_lines(api: httpx2.Client, done: str) -> None:
    path = f"/v1/jobs/{done}/image.npy"
    tag = api.get(path).headers[TAG]
    for name, status in (("If-None-Match", 304), ("If-Match", 200)):
        assert api.get(path, headers=[(name, '"other, too"'), (name, tag)]).status_code == status
    sent = {"scene": scene(8, 8, samples=1)}
    kept, anew = ("Cache-Control", "max-age=0"), ("Cache-Control", "no-cache")
    for lines, is_shared in (([kept], False), ([kept], True), ([kept, anew], False)):
        lines += [("Prefer", "respond-async"), ("Prefer", 'wait="20"')]
        answer = api.post("/v1/jobs", json=sent, headers=lines)
        assert (answer.headers["Preference-Applied"], answer.json()["state"]) == ("wait=20", "succeeded")
        log = api.get(f"/v1/jobs/{answer.json()['id']}/log").json()
        events = [entry["event"] for entry in log["entries"]]
        assert ("shared" in events) is is_shared, lines


def test_range_outside_the_file_is_a_problem(api: httpx2.Client, done: str) -> None:
    for asked in ("bytes=99999999-", "bytes=5-2", "bytes=-0", "bytes=x", "bytes=", "bytes"):
        answer = api.get(f"/v1/jobs/{done}/image.npy", headers={"Range": asked})
        problem_of(answer, 416)
        assert answer.headers["Content-Range"].startswith("bytes */")


def test_thumbnail_is_the_mean_of_what_is_shown(api: httpx2.Client) -> None:
    job = submit(api, scene(192, 64, samples=1, light_samples=1))
    finish(api, job)
    path = f"/v1/jobs/{job}/image.png"
    whole, small = (api.get(path, params=params) for params in ({}, {"width": 96}))
    means = np.asarray(opened(whole), float).reshape(32, 2, 96, 2, 3).mean(axis=(1, 3))
    # Means are rounded along one side, and then along the other.
    assert np.abs(np.asarray(opened(small), float) - means).max() <= 1
    assert small.headers["ETag"] != whole.headers["ETag"]
    again = api.get(path, params={"width": 96}, headers={"If-None-Match": small.headers["ETag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert api.get(path, params={"width": 97}).status_code == 422


@pytest.mark.slow
def test_plot_names_the_extra_that_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    missing = tmp_path / "missing"
    missing.mkdir()
    (missing / "matplotlib.py").write_text("raise ImportError")
    monkeypatch.setenv("PYTHONPATH", str(missing))
    settings = Settings(data=tmp_path, port=0, workers=1)
    with running(settings) as server, httpx2.Client(base_url=server.url, timeout=TIMEOUT) as client:
        job = submit(client, scene(8, 8, samples=1))
        path = f"/v1/jobs/{job}/convergence"
        for form in ("svg", "png"):
            assert problem_of(client.get(path, params={"format": form}), 501)["code"] == "extra_missing"
        assert client.get(path, params={"format": "csv"}).status_code == 200
        finish(client, job)
