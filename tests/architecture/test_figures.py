"""Pages say what the kept measurements and the code say, and are not written without them."""

import importlib.util
import re
from pathlib import Path

import pytest

from tests.architecture.sources import ROOT
from tools.docs import figures, fill_figures, write_pages

PAGES = write_pages.pages()
NUMERICS = {"hard_cases", "stability"}
"""Figures of the pages about numerics, which `tests/numerics/test_page.py` holds to them."""

DRAWN = {"intervals"}
"""Figures that diagrams show, which `test_diagrams.py` holds to them."""

COUNTED = {"hard_cases"}
"""What is the same on every machine."""

BY_HAND = [
    path
    for path in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*/*.md")))
    if path not in {page.path for page in write_pages.GENERATED} and "numerics" not in path.stem
]
FENCED = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
DATE = re.compile(r"\b20\d\d-\d\d-\d\d\b(?!T)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.path.stem)
def test_a_page_says_what_it_is_made_of(page: write_pages.Page) -> None:
    assert page.path.read_text(encoding="utf-8") == page.text(), "run python -m tools.docs.write_pages"


def test_where_figures_are_missing_the_message_says_how_to_measure_them(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(figures, "FOLDER", tmp_path)
    with pytest.raises(figures.MissingFiguresError, match="python -m benchmarks stability --runs 9"):
        figures.read("stability")


def test_every_file_of_figures_is_shown_and_has_the_command_that_measures_it() -> None:
    kept = {path.stem for path in figures.FOLDER.iterdir()}
    assert kept == {name for page in PAGES for name in page.figures} | NUMERICS | DRAWN
    assert kept == set(figures.COMMANDS)


def test_no_figures_are_on_two_generated_pages() -> None:
    shown = [name for page in write_pages.GENERATED for name in page.figures]
    assert len(shown) == len(set(shown))


@pytest.mark.parametrize("figure", sorted(set(figures.COMMANDS) - COUNTED))
def test_figures_name_the_day_and_the_machine_on_which_they_were_measured(figure: str) -> None:
    kept = figures.read(figure)
    machines = [part["machine"] for part in ([kept] if "machine" in kept else kept.values())]
    assert [machine for machine in machines if not {"date", "cpu", "cores", "python"} <= machine.keys()] == []
    assert [machine for machine in machines if not DATE.match(machine["date"][:10])] == []


@pytest.mark.parametrize("figure", figures.COMMANDS)
def test_a_command_that_measures_figures_is_there(figure: str) -> None:
    command = figures.COMMANDS[figure]
    modules = re.findall(r"python -m ([\w.]+)", command)
    targets = re.findall(r"make ([\w-]+)", command)
    makefile = (ROOT / "Makefile").read_text()
    assert modules or targets
    assert [module for module in modules if importlib.util.find_spec(module) is None] == []
    assert [target for target in targets if not re.search(rf"^{target}:", makefile, re.MULTILINE)] == []
    assert re.findall(r"--out (\S+)", command) in ([], [f"docs/figures/{figure}.json"])


def test_every_text_that_is_made_of_figures_is_on_a_page() -> None:
    marks = [
        found[1] for path in fill_figures.pages() for found in fill_figures.MARKED.finditer(path.read_text())
    ]
    assert sorted(marks) == sorted(fill_figures.TEXTS)


def test_a_mark_that_no_text_has_is_an_error() -> None:
    with pytest.raises(KeyError, match="no-such-text"):
        fill_figures.filled("<!-- no-such-text -->1.5 s<!-- /no-such-text -->")


@pytest.mark.parametrize("path", BY_HAND, ids=lambda path: path.stem)
def test_a_page_by_hand_has_no_measurement_of_its_own(path: Path) -> None:
    """What was measured has a date, and stands between marks that are filled from figures."""
    text = fill_figures.MARKED.sub("", FENCED.sub("", path.read_text(encoding="utf-8")))
    assert DATE.findall(text) == []
