"""The page about the studies of the repository's own scenes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from accuracy.study import report
from accuracy.study.running import Study
from accuracy.study.settings import PATTERNS, Scale
from tests.accuracy.study.scenes import scene
from tools.docs import generate_accuracy_page as generator

ROOT = Path(__file__).parents[3]
SCALE = Scale(
    side=12,
    references=(16,),
    random=((1, 4), (4, 1), (4, 4), (16, 4)),
    regular=((1, 4), (4, 1), (4, 4), (16, 4)),
    errors_255=(8.0,),
    seeds=1,
)


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A tiny study in the place of each scene's."""
    study = Study(scene(), tmp_path_factory.mktemp("study"), SCALE)
    results = generator.rounded(report.answered(study.run(lambda _: None)))
    return dict.fromkeys(generator.SCENES, results)


@pytest.fixture(scope="module")
def page(measured: dict[str, Any]) -> str:
    """The page of it."""
    return generator.page(measured)


def tables(page: str) -> list[list[list[str]]]:
    """Cells of every table."""
    blocks = re.findall(r"(?:^\|.*\|\n?)+", page, re.MULTILINE)
    return [[line.strip("| ").split(" | ") for line in block.splitlines()] for block in blocks]


def test_every_table_has_as_many_cells_in_each_line(page: str) -> None:
    found = tables(page)
    assert len(found) > 20
    assert [block for block in found if len({len(line) for line in block}) != 1] == []


def test_every_image_of_the_page_is_one_that_is_taken_over(page: str, measured: dict[str, Any]) -> None:
    shown = set(re.findall(r"\(\.\./images/study/([^)]+)\)", page))
    assert shown == set(generator.images_of(measured))


def test_the_chess_board_is_compared_at_equal_numbers_of_samples(page: str, measured: dict[str, Any]) -> None:
    rows = next(block for block in tables(page) if block[0][0] == "camera samples")[2:]
    assert [row[1] for row in rows] == 3 * list(PATTERNS)
    known = {row["name"]: row for row in measured["chess"]["settings"]}
    for samples, pattern, _, error, _, _ in rows:
        expected = known[f"{pattern} {samples} x 4"]["rmse_255"]["estimate"]
        assert float(error.split()[0]) == pytest.approx(expected, rel=0.01)


def test_scenes_are_those_of_make_study() -> None:
    makefile = (ROOT / "Makefile").read_text()
    named = re.search(r"^STUDIED := (.*)$", makefile, re.MULTILINE)
    assert named
    folders = {Path(path).name: Path(path).parent.name for path in named[1].split()}
    assert folders == generator.SCENES
    assert [path for path in named[1].split() if not (ROOT / "scenes" / f"{path}.json").exists()] == []


def test_what_is_kept_of_a_figure_is_more_than_a_table_shows() -> None:
    assert generator.rounded({"a": [1.23456789, 3, "x", None]}) == {"a": [1.2346, 3, "x", None]}
