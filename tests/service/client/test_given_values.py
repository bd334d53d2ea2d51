"""Values given to the clients, and the errors if they cannot be used: nothing is sent here."""

import asyncio
import base64
import io
import pickle
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
from PIL import Image

import schemas
from schemas.api.jobs import Failure
from schemas.errors import Problem, ProblemDocument, SceneError
from service.client import (
    AsyncClient,
    Client,
    ClientError,
    JobCancelledError,
    JobFailedError,
    RequestInvalidError,
    TimedOutError,
    UnreachableError,
)
from service.client.comparing import sent
from service.client.exchange import refused
from service.client.parcels import pack, rows
from service.client.pictures import Picture
from tests.service.cli.conftest import SCENE

NO_SERVER = "http://127.0.0.1:9"


PIXELS = np.linspace(0, 1, 24, dtype=np.float32).reshape(2, 4, 3)


class Rendered:
    image = PIXELS


@pytest.mark.parametrize(
    "picture",
    [PIXELS, PIXELS.astype(np.float64), PIXELS[::-1, ::-1][::-1, ::-1], Rendered()],
    ids=["float32", "float64", "not contiguous", "a result"],
)
def test_array_is_sent_as_npy(picture: Any) -> None:
    assert np.array_equal(
        np.load(io.BytesIO(base64.b64decode(sent(picture, None).document["content"]))), PIXELS
    )


def test_forms_of_pictures(tmp_path: Path) -> None:
    image = Image.new("RGB", (2, 2), (10, 20, 30))
    image.save(tmp_path / "a.png")
    content = (tmp_path / "a.png").read_bytes()
    for form in (content, bytearray(content), memoryview(content), Picture(content, 1.0), tmp_path / "a.png"):
        assert base64.b64decode(sent(form, None).document["content"]) == content
    made = Image.open(io.BytesIO(base64.b64decode(sent(image, None).document["content"])))
    assert (made.format, made.getpixel((1, 1))) == ("PNG", (10, 20, 30))


def test_folder_may_be_a_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.png").write_bytes(b"one")
    scene = {"version": 1, "textures": {"x": {"type": "image", "asset": "a.png"}}}
    monkeypatch.chdir(tmp_path)
    for folder in (".", Path(), str(tmp_path)):
        assert list(pack(scene, assets=folder).contents.values()) == [b"one"]
    with pytest.raises(NotADirectoryError, match="nowhere"):
        pack(scene, assets="nowhere")


def test_scenes_of_numpy_and_models() -> None:
    camera = SCENE["camera"] | {"width": np.int64(48), "position": np.array(SCENE["camera"]["position"])}
    assert pack(SCENE | {"camera": camera}).document == SCENE
    checked = schemas.Scene.model_validate(SCENE)
    again = schemas.Scene.model_validate(pack(checked).document)
    assert again == checked


def test_invalid_rays() -> None:
    assert rows([], np.zeros((0, 3))) == {"origins": [], "directions": []}
    assert rows(np.zeros((1, 3), np.float16), [[0, 0, 1]])["directions"] == [[0.0, 0.0, 1.0]]
    with pytest.raises(ValueError, match=r"directions .*\(N, 3\), not \(3,\)"):
        rows([[0, 0, 0]], [0, 0, 1])


@pytest.mark.parametrize(
    "use",
    [lambda client: client.version(), lambda client: client.get("1"), lambda client: client.submit(SCENE)],
)
def test_closed_client(use: Callable[[Any], Any]) -> None:
    with Client(NO_SERVER) as client:
        pass
    client.close()
    with pytest.raises(ClientError, match="closed"):
        use(client)

    async def awaited(use: Callable[[Any], Awaitable[Any]]) -> None:
        async with AsyncClient(NO_SERVER) as later:
            pass
        await use(later)

    with pytest.raises(ClientError, match="closed"):
        asyncio.run(awaited(use))


@pytest.mark.parametrize("seconds", [-1, -1e-300, float("nan"), float("-inf")], ids=str)
def test_seconds_that_are_none(seconds: float) -> None:
    for name in ("timeout", "retry_seconds"):
        with pytest.raises(ValueError, match=name):
            Client(NO_SERVER, **{name: seconds})
    with Client(NO_SERVER, retry_seconds=0) as client:
        with pytest.raises(ValueError, match="timeout"):
            client.wait("1", timeout=seconds)
        with pytest.raises(ValueError, match="wait"):
            client.submit(SCENE, wait=seconds)


PROBLEMS = (
    Problem(
        pointer="/camra",
        detail="This field is not known here.",
        code="x",
        suggestion="camera",
        line=1,
        column=9,
    ),
    Problem(pointer="", detail="The field 'camera' is missing. Add it.", code="y"),
)
DOCUMENT = ProblemDocument(title="Unprocessable Entity", status=422, errors=PROBLEMS, more=3)


def test_refusal_has_pointer_and_suggestion() -> None:
    answer = httpx2.Response(
        422, headers={"Content-Type": "application/problem+json"}, content=DOCUMENT.model_dump_json()
    )
    _, first, second, more = str(refused(answer)).splitlines()
    assert first.startswith(f"/camra: {PROBLEMS[0].detail}")
    assert first.endswith("'camera'?")
    assert second == f"(whole document): {PROBLEMS[1].detail}"
    assert "3 more" in more
    here = str(SceneError(PROBLEMS))
    assert here.startswith("line 1, column 9: /camra: ")
    assert here.endswith("(and 1 more)")


@pytest.mark.parametrize(
    "error",
    [
        RequestInvalidError(422, DOCUMENT, retry_after=2.0),
        UnreachableError("away", sent=False, job_id="1"),
        TimedOutError("It took long.", job_id="1"),
        JobCancelledError(job_id="1"),
        JobFailedError(job_id="1", failure=Failure(code="x", message="y", retryable=True)),
    ],
    ids=lambda error: type(error).__name__,
)
def test_errors_are_pickled(error: ClientError) -> None:
    again = pickle.loads(pickle.dumps(error))  # noqa: S301 - made in this very line
    assert (type(again), str(again), vars(again)) == (type(error), str(error), vars(error))
