"""The examples of the documentation, run as a reader would run them."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import renderer
from service.server import RunningServer
from tests.acceptance.conftest import shrink, succeeds
from tests.pages import blocks, missing, page
from tests.service.cli.conftest import ROOT, Outcome

RECIPE = r"(?ms)^!\[[^]]+\]\(\.\./(images/cookbook/[\w-]+\.png)\)\n.*?^```json\n(.*?)^```"
RECIPES = dict(re.findall(RECIPE, page("how-to/cookbook.md")))


@pytest.mark.parametrize("picture", RECIPES, ids=lambda path: Path(path).stem)
def test_recipe_is_valid_and_its_picture_has_its_size(picture: str) -> None:
    loaded = renderer.load_scene(RECIPES[picture].encode(), assets=ROOT)
    camera = loaded.document.camera
    assert loaded.warnings == ()
    with Image.open(ROOT / "docs" / picture) as shown:
        assert shown.size == (camera.width, camera.height)


def follow(name: str, folder: Path, server: RunningServer) -> Outcome:
    """Run all commands of a page in a folder, one after another, in one shell."""
    commands = blocks(page(name), "sh")
    assert commands
    script = "\n".join(commands).replace("http://127.0.0.1:8000", server.url)
    # A study takes as long as its budget.
    script = re.sub(r"--budget \d+", "--budget 2", script)
    return succeeds(script, folder, PENUMBRA_SERVER=server.url)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("curl") is None, reason="the examples use curl")
def test_http_page_requests_work(server: RunningServer, checkout: Path) -> None:
    done = follow("reference/http.md", checkout, server)
    assert "304" in done.out
    assert "unknown_field" in done.out


@pytest.mark.slow
def test_python_page_examples_work(server: RunningServer, checkout: Path) -> None:
    examples = blocks(page("reference/python.md"), "python")
    (test,) = [block for block in examples if "def test_" in block]
    script = "\n".join(block for block in examples if block is not test)
    for name in ("mine.npy", "reference.npy"):
        np.save(checkout / name, np.full((16, 16, 3), 0.5))
    (checkout / "test_page.py").write_text("import numpy as np\n" + test)
    done = succeeds(
        'python -c "$SCRIPT"\npython -m pytest -q -p accuracy.pytest_plugin test_page.py',
        checkout,
        SCRIPT=script.replace("http://127.0.0.1:8000", server.url),
        PENUMBRA_SERVER=server.url,
        PYTEST_DISABLE_PLUGIN_AUTOLOAD="1",
    )
    assert (checkout / "texturing.png").read_bytes().startswith(b"\x89PNG")
    assert "1 passed" in done.out


@pytest.mark.slow
@pytest.mark.parametrize("name", ["reference/command-line.md", "how-to/choosing-quality.md"])
def test_page_commands_work(name: str, server: RunningServer, checkout: Path) -> None:
    shrink(checkout / "scenes" / "gallery")
    follow(name, checkout, server)


@pytest.mark.slow
def test_first_picture_tutorial_gives_what_it_shows(server: RunningServer, checkout: Path) -> None:
    name = "tutorials/first-picture.md"
    done = follow(name, checkout, server)
    assert missing(name, done.out) == []
    verdicts = re.findall(r"^\| `[\w.-]+` \| `(\w+)` \|", page(name), re.MULTILINE)
    assert re.findall(r"^(\w*match): ", done.out, re.MULTILINE) == verdicts
    assert re.search(r"^where: .*, mostly floor \(shapes/0\)$", done.out, re.MULTILINE)
    reached = re.search(r"^good\.png: .*, error ([\d.e-]+) ", done.err, re.MULTILINE)
    assert reached
    assert float(reached[1]) <= 0.004
    made = ["my-scene.png", "small-lamp.png", "noisy.png", "difference.png", "study/report.html"]
    assert [name for name in made if not (checkout / name).exists()] == []


@pytest.mark.slow
def test_first_assignment_tutorial_gives_what_it_shows(server: RunningServer, checkout: Path) -> None:
    name = "tutorials/first-assignment.md"
    done = follow(name, checkout, server)
    assert missing(name, done.out) == []
    assert "hard_shadows" in (checkout / "graded" / "page.html").read_text()
