from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from service.cli.process import outcome

COMMAND = [sys.executable, "-m", "service.cli.main"]
# Nothing of the machine that the tests run on may leak into them.
CLEAN = {name: value for name, value in os.environ.items() if not name.startswith("PENUMBRA_")}

SCENE: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 2, 8], "look_at": [0, 1, 0], "vertical_fov": 38, "width": 48, "height": 32},
    "materials": {"floor": {"type": "phong", "color": [0.75, 0.75, 0.75]}},
    "shapes": [
        {
            "type": "rectangle",
            "center": [0, 0, 0],
            "normal": [0, 1, 0],
            "tangent": [1, 0, 0],
            "size": [4, 4],
            "material": "floor",
        },
        {"type": "ellipsoid", "center": [0, 1, 0], "radius": 0.5, "material": "floor"},
    ],
    "lights": [{"type": "point", "position": [0, 4, 0], "color": [0.8, 0.8, 0.8]}],
    "sampling": {"antialiasing": {"pattern": "center", "samples": 1}},
}


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str

    @property
    def document(self) -> Any:
        """All of stdout as one JSON document."""
        return json.loads(self.out)


Penumbra = Callable[..., Outcome]


@pytest.fixture
def penumbra(tmp_path: Path) -> Penumbra:
    """Run the command in an empty folder."""

    def run(*words: object, stdin: str = "") -> Outcome:
        done = subprocess.run(
            [*COMMAND, *map(str, words)],
            input=stdin,
            capture_output=True,
            text=True,
            cwd=tmp_path,
            env=CLEAN | {"PYTHONPATH": str(Path(__file__).parents[3])},
            timeout=120,
            check=False,
        )
        return Outcome(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Penumbra:
    """Run the command in this process, which has loaded everything, as if it were one of its own.

    For commands that only read files, write files and print; each of them runs in a process of its own, too.
    """
    for name in set(os.environ) - set(CLEAN):
        monkeypatch.delenv(name)
    monkeypatch.chdir(tmp_path)

    def run(*words: object, stdin: str = "") -> Outcome:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin.encode())))
        code = outcome([str(word) for word in words])
        return Outcome(code, *capsys.readouterr())

    return run


@pytest.fixture
def scene() -> dict[str, Any]:
    """A small scene, to be changed."""
    document: dict[str, Any] = json.loads(json.dumps(SCENE))
    return document


@pytest.fixture
def scene_file(tmp_path: Path) -> Path:
    """A small scene that is fine."""
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(SCENE, indent=2))
    return path
