"""The examples of the documentation, run as a reader would run them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.acceptance.conftest import ENVIRONMENT, ROOT, Server

pytestmark = pytest.mark.slow


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A folder that has what a checkout has, where examples may write."""
    shutil.copytree(ROOT / "scenes", tmp_path / "scenes")
    return tmp_path


@pytest.mark.skipif(shutil.which("curl") is None, reason="the examples use curl")
def test_every_request_of_the_http_page_works(server: Server, checkout: Path) -> None:
    page = (ROOT / "docs" / "reference" / "http.md").read_text()
    blocks = re.findall(r"^```sh\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    assert len(blocks) >= 7
    script = "\n".join(["set -eu -o pipefail", *blocks]).replace("http://127.0.0.1:8000", server.url)
    done = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, cwd=checkout, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "304" in done.stdout
    assert "unknown_field" in done.stdout


def test_every_example_of_the_python_page_works(server: Server, checkout: Path) -> None:
    page = (ROOT / "docs" / "reference" / "python.md").read_text()
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    tests = [block for block in blocks if "def test_" in block]
    assert len(tests) == 1
    script = "\n".join(block for block in blocks if block not in tests)
    picture = np.full((16, 16, 3), 0.5)
    np.save(checkout / "mine.npy", picture)
    np.save(checkout / "reference.npy", picture)
    (checkout / "test_page.py").write_text("import numpy as np\n" + tests[0])
    pytest_words = ["-m", "pytest", "-q", "-p", "accuracy.pytest_plugin", "test_page.py"]
    environment = ENVIRONMENT | {"PENUMBRA_SERVER": server.url, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    for words in (["-c", script.replace("http://127.0.0.1:8000", server.url)], pytest_words):
        done = subprocess.run(
            [sys.executable, *words],
            capture_output=True,
            text=True,
            cwd=checkout,
            env=environment,
            timeout=180,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
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
def test_every_command_of_a_page_works(name: str, server: Server, checkout: Path) -> None:
    reduce(checkout / "scenes" / "gallery")
    follow(name, checkout, server)


def follow(name: str, folder: Path, server: Server) -> subprocess.CompletedProcess[str]:
    """Run all commands of a page in a folder, one after another, in one shell."""
    page = (ROOT / "docs" / name).read_text()
    blocks = re.findall(r"^```sh\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    assert len(blocks) >= 4
    here = f"{Path(sys.executable).parent}:{ENVIRONMENT.get('PATH', '')}"
    done = subprocess.run(
        ["bash", "-c", "\n".join(["set -eu -o pipefail", *blocks])],
        capture_output=True,
        text=True,
        cwd=folder,
        env=ENVIRONMENT | {"PATH": here, "PENUMBRA_SERVER": server.url},
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done


def missing(name: str, printed: str) -> list[str]:
    """Lines of output that a page shows and its commands did not print; a pipe gets tabs for blanks."""
    page = (ROOT / "docs" / name).read_text()
    shown = re.findall(r"^```text\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    assert shown
    lines = (" ".join(line.split()) for block in shown for line in block.splitlines())
    return [line for line in lines if line not in " ".join(printed.split())]


def test_a_reader_who_follows_the_first_tutorial_gets_what_it_shows(server: Server, checkout: Path) -> None:
    name = "tutorials/first-picture.md"
    done = follow(name, checkout, server)
    assert missing(name, done.stdout) == []
    page = (ROOT / "docs" / name).read_text()
    verdicts = re.findall(r"^\| `[\w.-]+` \| `(\w+)` \|", page, re.MULTILINE)
    assert re.findall(r"^(\w*match): ", done.stdout, re.MULTILINE) == verdicts
    assert re.search(r"^where: .*, mostly floor \(shapes/0\)$", done.stdout, re.MULTILINE)
    reached = re.search(r"^good\.png: .*, error ([\d.e-]+) ", done.stderr, re.MULTILINE)
    assert reached
    assert float(reached[1]) <= 0.004
    made = ["my-scene.png", "small-lamp.png", "noisy.png", "difference.png", "study/report.html"]
    assert [name for name in made if not (checkout / name).exists()] == []


def test_an_instructor_who_follows_the_tutorial_gets_what_it_shows(server: Server, checkout: Path) -> None:
    # The wheel is built by a command that needs the package index.
    (checkout / "dist").mkdir()
    (checkout / "dist" / "penumbra_render-1-py3-none-any.whl").touch()
    name = "tutorials/first-assignment.md"
    done = follow(name, checkout, server)
    assert missing(name, done.stdout) == []
    assert "hard_shadows" in (checkout / "graded" / "page.html").read_text()
