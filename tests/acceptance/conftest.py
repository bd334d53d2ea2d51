import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.server import RunningServer, running
from service.settings import Settings
from tests.service.cli.conftest import ROOT, Outcome, ended

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


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    """A running service that the tests of a module share."""
    settings = Settings(data=tmp_path_factory.mktemp("service"), port=0, workers=2, log_level="error")
    with running(settings) as started:
        yield started


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
