"""What pages and messages say about installing the package and its extras is true of the package."""

import re
import subprocess
import sys
import tomllib

from service.cli.doctor import DEVELOPERS
from tests.architecture.sources import ROOT, text_files
from tools import try_pythons

PAGE = (ROOT / "docs" / "how-to" / "installing.md").read_text()
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"].keys()


def test_the_page_about_installing_has_every_extra_that_users_need() -> None:
    rows = re.findall(r"^\| `([a-z0-9]+)` \|", PAGE, re.MULTILINE)
    assert rows == sorted(EXTRAS - set(DEVELOPERS))


def test_the_page_about_installing_names_the_extras_that_make_installs() -> None:
    [installed] = re.findall(r"--editable '\.\[([a-z0-9,]+,[a-z0-9,]+)\]'", (ROOT / "Makefile").read_text())
    [named] = re.findall(r"with the extras (.+?)\.\n", PAGE, re.DOTALL)
    assert re.findall(r"`([a-z0-9]+)`", named) == installed.split(",")


def test_every_command_that_installs_an_extra_names_one_that_there_is() -> None:
    texts = [(ROOT / path).read_text() for path in text_files() if path.parts[0] != "tests"]
    named = {extra for text in texts for extra in re.findall(r"penumbra-render\[([a-z0-9]+)\]", text)}
    assert len(named) > 5
    assert named <= EXTRAS


def test_the_oldest_numpy_that_is_allowed_is_the_oldest_that_is_tried() -> None:
    (allowed,) = (line for line in PROJECT["dependencies"] if line.startswith("numpy"))
    assert allowed.startswith(try_pythons.OLDEST_NUMPY.replace("==", ">=").removesuffix(".*") + ",")
    assert PROJECT["requires-python"] == f">={try_pythons.VERSIONS[0]}"


def test_pip_adds_an_extra_by_its_name_without_a_package_index_that_has_the_package() -> None:
    command = [sys.executable, "-m", "pip", "install", "--dry-run", "--no-index", "penumbra-render[exr]"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "Would install" not in done.stdout


def test_no_page_installs_the_package_from_a_package_index() -> None:
    pages = [path for path in text_files() if path.suffix == ".md"]
    assert [
        path for path in pages if re.search(r"pip install '?penumbra-render(?!\[)", (ROOT / path).read_text())
    ] == []
