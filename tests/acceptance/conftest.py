from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
COMMAND = [sys.executable, "-m", "service.cli.main"]
# The tests must not depend on the environment of this machine; `penumbra` is that of this Python.
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith("PENUMBRA_")} | {
    "PYTHONPATH": str(ROOT),
    "PATH": f"{Path(sys.executable).parent}:{os.environ.get('PATH', '')}",
}
START_SECONDS = 60


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str

    @property
    def document(self) -> Any:
        """All of stdout as one JSON document."""
        return json.loads(self.out)


def shell(
    script: str, folder: Path, *, timeout: float = 300, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run commands in one shell, as a reader does; the first that fails ends them, and the test."""
    done = subprocess.run(
        ["bash", "-eu", "-o", "pipefail", "-c", script],
        capture_output=True,
        text=True,
        cwd=folder,
        env=ENVIRONMENT | environment,
        timeout=timeout,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
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
        with log.open("wb") as stderr:
            words = ["serve", "--port", str(self.port), "--data", str(self.folder / "data"), "--workers", "2"]
            self.process = subprocess.Popen([*COMMAND, *words], stderr=stderr, env=ENVIRONMENT)
        deadline = time.monotonic() + START_SECONDS
        while (found := re.search(r"http://127\.0\.0\.1:(\d+)", log.read_text())) is None:
            assert self.process.poll() is None, log.read_text()
            assert time.monotonic() < deadline, log.read_text()
            time.sleep(0.02)
        self.url, self.port = found[0], int(found[1])

    def kill(self) -> None:
        """End it as a power cut would."""
        self.process.kill()
        self.process.wait()

    def stop(self) -> None:
        """End it as an operator would."""
        self.process.terminate()
        self.process.wait()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A running service that the tests of a module share."""
    running = Server(tmp_path_factory.mktemp("service"))
    yield running
    running.stop()


Penumbra = Callable[..., Outcome]


@pytest.fixture
def penumbra(server: Server, tmp_path: Path) -> Penumbra:
    """Run the command in an empty folder, with the shared service as its server."""

    def run(*words: object) -> Outcome:
        done = subprocess.run(
            [*COMMAND, *map(str, words)],
            capture_output=True,
            text=True,
            cwd=tmp_path,
            env=ENVIRONMENT | {"PENUMBRA_SERVER": server.url},
            timeout=120,
            check=False,
        )
        return Outcome(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture
def scene() -> dict[str, Any]:
    """A small scene of the gallery, with textures, to be changed."""
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
    """The same as a file beside its textures."""
    for texture in scene["textures"].values():
        if texture["type"] == "image":
            target = tmp_path / texture["asset"]
            target.parent.mkdir(exist_ok=True)
            target.write_bytes((ROOT / "scenes/gallery" / texture["asset"]).read_bytes())
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(scene, indent=2))
    return path


@pytest.fixture
def endless_file(scene_file: Path, scene: dict[str, Any]) -> Path:
    """A scene that takes far longer than any test."""
    scene["camera"] |= {"width": 512, "height": 512}
    scene["sampling"]["antialiasing"]["samples"] = 1024
    scene["sampling"]["light"]["samples"] = 256
    path = scene_file.with_name("endless.json")
    path.write_text(json.dumps(scene))
    return path
