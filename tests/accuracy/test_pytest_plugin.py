"""The plugin as users of the installed package run it: pytest started in a folder of its own."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

TESTS = """
import numpy as np
import pytest

GREY = np.full((16, 16, 3), 0.5)

def test_same(assert_render_close):
    assert assert_render_close(GREY, GREY).judgement.verdict == "match"

@pytest.mark.parametrize("name", ["a/b", "c d"])
def test_other(assert_render_close, name):
    assert_render_close(GREY + 0.2, GREY)

def test_twice(assert_render_close):
    for shift in (0.1, 0.2):
        with pytest.raises(AssertionError):
            assert_render_close(GREY + shift, GREY)

def test_own_folder(assert_render_close, tmp_path):
    with pytest.raises(AssertionError, match="mine"):
        assert_render_close(GREY + 0.1, GREY, folder=tmp_path / "mine")
"""
IDLE = """
import sys

def test_nothing_is_loaded():
    assert "numpy" not in sys.modules
    assert "PIL" not in sys.modules
"""


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """A folder of packages in which this one's entry point is, as an installer would write it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    about = tmp_path / "packages" / "penumbra_render-0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: penumbra-render\nVersion: 0\n")
    points = project["entry-points"]["pytest11"].items()
    (about / "entry_points.txt").write_text(
        "[pytest11]\n" + "".join(f"{name} = {place}\n" for name, place in points)
    )
    return about.parent


def started(folder: Path, installed: Path, tests: str, *words: str) -> subprocess.CompletedProcess[str]:
    folder.mkdir(exist_ok=True)
    (folder / "test_mine.py").write_text(tests)
    # Of plugins that are installed here only ours counts.
    alone = ["-p", "no:hypothesispytest", "-p", "no:schemathesis", "-p", "no:anyio", "-W", "error"]
    return subprocess.run(
        [sys.executable, "-m", "pytest", *alone, "--basetemp", str(folder / "temporary"), *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": f"{installed}:{ROOT}"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_difference_fails_and_names_its_pictures(tmp_path: Path, installed: Path) -> None:
    folder = tmp_path / "theirs"
    done = started(folder, installed, TESTS)
    assert "3 passed" in done.stdout, done.stdout + done.stderr
    assert "2 failed" in done.stdout
    places = [Path(place) for place in re.findall(r"heat.png in (\S+)", done.stdout)]
    assert places
    assert all((place / "heat.png").exists() for place in places)
    assert {place.parents[1] for place in places} == {folder / "temporary"}
    twice = folder / "temporary" / "test_twice0"
    assert [path.name for path in sorted(twice.iterdir())] == ["render-difference", "render-difference-2"]
    # The line of the test is shown, not those behind it.
    assert "asserting.py" not in done.stdout
    assert "pytest_plugin.py" not in done.stdout


def test_plugin_that_is_not_used_loads_nothing(tmp_path: Path, installed: Path) -> None:
    done = started(tmp_path / "theirs", installed, IDLE)
    assert "1 passed" in done.stdout, done.stdout + done.stderr


@pytest.mark.slow
def test_option_collects_the_pictures_in_a_folder(tmp_path: Path, installed: Path) -> None:
    folder = tmp_path / "theirs"
    done = started(folder, installed, TESTS, "--render-differences", "found", "-k", "other")
    assert "2 failed" in done.stdout, done.stdout + done.stderr
    names = {path.parent.name for path in (folder / "found").glob("*/difference.png")}
    assert names == {"test_mine.py-test_other-a-b-", "test_mine.py-test_other-c-d-"}
