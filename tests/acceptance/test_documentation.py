"""The examples of the documentation, run as a reader would run them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.acceptance.conftest import ROOT, Server, shell
from tests.pages import blocks, missing, page

pytestmark = pytest.mark.slow


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A folder that has what a checkout has, where examples may write."""
    shutil.copytree(ROOT / "scenes", tmp_path / "scenes")
    shutil.copy(ROOT / "constraints.txt", tmp_path)
    return tmp_path


@pytest.mark.skipif(shutil.which("curl") is None, reason="the examples use curl")
def test_http_page_requests_work(server: Server, checkout: Path) -> None:
    examples = blocks(page("reference/http.md"), "sh")
    assert len(examples) >= 7
    done = shell("\n".join(examples).replace("http://127.0.0.1:8000", server.url), checkout)
    assert "304" in done.stdout
    assert "unknown_field" in done.stdout


def test_python_page_examples_work(server: Server, checkout: Path) -> None:
    examples = blocks(page("reference/python.md"), "python")
    (test,) = [block for block in examples if "def test_" in block]
    script = "\n".join(block for block in examples if block is not test)
    picture = np.full((16, 16, 3), 0.5)
    np.save(checkout / "mine.npy", picture)
    np.save(checkout / "reference.npy", picture)
    (checkout / "test_page.py").write_text("import numpy as np\n" + test)
    done = shell(
        'python -c "$SCRIPT"\npython -m pytest -q -p accuracy.pytest_plugin test_page.py',
        checkout,
        SCRIPT=script.replace("http://127.0.0.1:8000", server.url),
        PENUMBRA_SERVER=server.url,
        PYTEST_DISABLE_PLUGIN_AUTOLOAD="1",
    )
    assert (checkout / "texturing.png").read_bytes().startswith(b"\x89PNG")
    assert "1 passed" in done.stdout


def reduce(scenes: Path) -> None:
    """Give scenes pictures of 128 pixels: what commands do with them is the same in every size."""
    for path in scenes.glob("*.json"):
        document = json.loads(path.read_text())
        camera = document["camera"]
        camera["width"], camera["height"] = 128, 128 * camera["height"] // camera["width"]
        path.write_text(json.dumps(document, indent=2))


@pytest.mark.parametrize("name", ["reference/command-line.md", "how-to/choosing-quality.md"])
def test_page_commands_work(name: str, server: Server, checkout: Path) -> None:
    reduce(checkout / "scenes" / "gallery")
    follow(name, checkout, server)


def follow(name: str, folder: Path, server: Server) -> subprocess.CompletedProcess[str]:
    """Run all commands of a page in a folder, one after another, in one shell."""
    commands = blocks(page(name), "sh")
    assert len(commands) >= 4
    return shell("\n".join(commands), folder, PENUMBRA_SERVER=server.url)


def test_first_picture_tutorial_gives_what_it_shows(server: Server, checkout: Path) -> None:
    name = "tutorials/first-picture.md"
    done = follow(name, checkout, server)
    assert missing(name, done.stdout) == []
    verdicts = re.findall(r"^\| `[\w.-]+` \| `(\w+)` \|", page(name), re.MULTILINE)
    assert re.findall(r"^(\w*match): ", done.stdout, re.MULTILINE) == verdicts
    assert re.search(r"^where: .*, mostly floor \(shapes/0\)$", done.stdout, re.MULTILINE)
    reached = re.search(r"^good\.png: .*, error ([\d.e-]+) ", done.stderr, re.MULTILINE)
    assert reached
    assert float(reached[1]) <= 0.004
    made = ["my-scene.png", "small-lamp.png", "noisy.png", "difference.png", "study/report.html"]
    assert [name for name in made if not (checkout / name).exists()] == []


def test_first_assignment_tutorial_gives_what_it_shows(server: Server, checkout: Path) -> None:
    # The wheel is built by a command that needs the package index.
    (checkout / "dist").mkdir()
    (checkout / "dist" / "penumbra_render-1-py3-none-any.whl").touch()
    name = "tutorials/first-assignment.md"
    done = follow(name, checkout, server)
    assert missing(name, done.stdout) == []
    assert "hard_shadows" in (checkout / "graded" / "page.html").read_text()
