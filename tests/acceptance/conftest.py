from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.service.cli.conftest import ROOT, Outcome, Penumbra, begun, ended, here, until

__all__ = ["here"]

BASH = ["bash", "-eu", "-o", "pipefail", "-c"]
SHELL_SECONDS = 550


def shell(script: str, folder: Path, **environment: str) -> Outcome:
    """Run commands in one shell, as a reader or a build does: the first that fails ends them."""
    return ended(folder, script, program=BASH, timeout=SHELL_SECONDS, **environment)


def succeeds(script: str, folder: Path, **environment: str) -> Outcome:
    """The same where all of them must succeed."""
    done = shell(script, folder, **environment)
    assert done.code == 0, done.out + done.err
    return done


class Server:
    """``penumbra serve`` as a process, on a data folder that outlives it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.port = 0
        self.start()

    def start(self) -> None:
        """Start it, on the same port as before where there was one."""
        log = self.folder / "log"
        words = ("serve", "--port", self.port, "--data", self.folder / "data", "--workers", 2)
        with log.open("wb") as stderr:
            self.process = begun(self.folder, *words, stderr=stderr)
        until(lambda: self.process.poll() is not None or "http://127" in log.read_text())
        found = re.search(r"http://127\.0\.0\.1:(\d+)", log.read_text())
        assert found, log.read_text()
        self.url, self.port = found[0], int(found[1])

    def stop(self) -> None:
        """End it as an operator would."""
        self.process.terminate()
        self.process.communicate()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A running service that the tests of a module share."""
    running = Server(tmp_path_factory.mktemp("service"))
    yield running
    running.stop()


@pytest.fixture
def penumbra(here: Penumbra, server: Server, monkeypatch: pytest.MonkeyPatch) -> Penumbra:
    """Run the command in this process and an empty folder, with the shared service as its server."""
    monkeypatch.setenv("PENUMBRA_SERVER", server.url)
    return here


@pytest.fixture
def scene(tmp_path: Path) -> dict[str, Any]:
    """A small scene of the gallery, to be changed, with its textures in the folder."""
    shutil.copytree(ROOT / "scenes/gallery/textures", tmp_path / "textures")
    document: dict[str, Any] = json.loads((ROOT / "scenes/gallery/texturing.json").read_text())
    document["camera"] |= {"width": 80, "height": 60}
    document["sampling"] = {
        "antialiasing": {"pattern": "stratified", "samples": 4},
        "light": {"pattern": "random", "samples": 4},
        "seed": 7,
    }
    return document


@pytest.fixture
def scene_file(tmp_path: Path, scene: dict[str, Any]) -> Path:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(scene, indent=2))
    return path


@pytest.fixture
def endless_file(tmp_path: Path, scene: dict[str, Any]) -> Path:
    """A scene that takes far longer than any test."""
    scene["camera"] |= {"width": 512, "height": 512}
    scene["sampling"]["antialiasing"]["samples"] = 1024
    scene["sampling"]["light"]["samples"] = 256
    path = tmp_path / "endless.json"
    path.write_text(json.dumps(scene))
    return path


def shrink(scenes: Path) -> None:
    """Give scenes pictures of 128 pixels: what commands do with them is the same in every size."""
    for path in scenes.glob("*.json"):
        document = json.loads(path.read_text())
        camera = document["camera"]
        camera["width"], camera["height"] = 128, 128 * camera["height"] // camera["width"]
        path.write_text(json.dumps(document, indent=2))


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A folder that has what a checkout has and the pages use, where examples may write."""
    shutil.copytree(ROOT / "scenes", tmp_path / "scenes")
    shutil.copy(ROOT / "constraints.txt", tmp_path)
    # The wheel is built by a command that needs the package index.
    (tmp_path / "dist").mkdir()
    (tmp_path / "dist" / "penumbra_render-1-py3-none-any.whl").touch()
    return tmp_path
