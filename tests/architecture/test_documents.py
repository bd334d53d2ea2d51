"""What is written about the project is true of it, and speaks of the project alone."""

import re
from pathlib import Path

import pytest
from typer.main import get_group

from service.cli.commands import application
from tests.architecture.sources import ROOT, text_files

PAGES = [path for path in text_files() if path.suffix == ".md"]
BLOCK = re.compile(r"^```(?:sh|console|bash)\n(.*?)^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
FENCED = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"(?<![\w/.-])(?:tools/)?docs/[\w/-]+\.(?:md|py|txt|toml)\b")
"""What a text calls by its path: a page, the script that writes it, or what that script reads."""
# A package index is the user's choice; a home folder is one person's.
ONE_MACHINE = re.compile(r"pythonhosted|index[-_]url|/home/\w|/Users/\w|/root/\w")


def links(path: Path) -> list[str]:
    """Relative links of a page."""
    return [link for link in LINK.findall(prose(ROOT / path)) if not re.match(r"[a-z]+:", link)]


def anchors(path: Path) -> set[str]:
    """Fragments that the headings of a page are reached by: equal ones after the first have a number."""
    found: list[str] = []
    for heading in HEADING.findall(prose(path)):
        words = re.sub(r"\]\([^)]*\)", "", heading).lower().replace(" ", "-")
        found.append(re.sub(r"[^\w-]", "", words))
    return {f"{name}-{found[:i].count(name)}" if name in found[:i] else name for i, name in enumerate(found)}


def prose(path: Path) -> str:
    """A page without its fenced blocks."""
    return FENCED.sub("", path.read_text())


@pytest.mark.parametrize("path", [path for path in text_files() if path.name != Path(__file__).name], ids=str)
def test_a_file_names_no_folder_of_one_machine_and_no_package_index(path: Path) -> None:
    text = (ROOT / path).read_text()
    assert not ONE_MACHINE.search(text)
    assert str(ROOT) not in text


@pytest.mark.parametrize("path", PAGES, ids=str)
def test_make_has_every_target_that_a_page_names(path: Path) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = set(re.findall(r"(?:^|`)make ([a-z-]+)", (ROOT / path).read_text(), re.MULTILINE))
    assert named <= targets


@pytest.mark.parametrize("path", PAGES, ids=str)
def test_the_command_line_has_every_command_that_a_page_shows(path: Path) -> None:
    shown = "\n".join(BLOCK.findall((ROOT / path).read_text()))
    commands = set(re.findall(r"(?:^|[\s/])penumbra ([a-z]+)", shown))
    assert commands <= set(get_group(application()).commands)


@pytest.mark.parametrize("path", PAGES, ids=str)
def test_a_page_links_to_files_and_headings_that_are_there(path: Path) -> None:
    broken = [link for link in links(path) if not is_there(path, link)]
    assert broken == []


def is_there(path: Path, link: str) -> bool:
    """Whether a relative link of a page leads to a file, and its fragment to a heading of that file."""
    name, _, fragment = link.partition("#")
    there = ROOT / path.parent / name if name else ROOT / path
    return there.exists() and (not fragment or fragment in anchors(there))


@pytest.mark.parametrize(
    ("link", "found"),
    [
        ("test_words.py", True),
        ("../../CONTRIBUTING.md#set-up", True),
        ("no_such_file.py", False),
        ("../../CONTRIBUTING.md#no-such-heading", False),
    ],
)
def test_a_link_is_there_if_its_file_and_its_heading_are(link: str, found: bool) -> None:
    assert is_there(Path(__file__).relative_to(ROOT), link) == found


def test_a_heading_is_reached_by_its_words_and_its_number_among_equal_ones(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# `n x n` points: 26.6 degrees?\n\n```sh\n# no heading\n```\n\n## Again\n\n## Again\n")
    assert anchors(page) == {"n-x-n-points-266-degrees", "again", "again-1"}


@pytest.mark.parametrize("path", text_files(), ids=str)
def test_a_page_or_a_script_that_a_file_names_is_there(path: Path) -> None:
    text = (ROOT / path).read_text()
    named = {match for match in NAMED.findall(text) if not (ROOT / match).exists()}
    assert named == set()


def test_the_index_has_each_page_once_under_its_kind() -> None:
    index = (ROOT / "docs" / "README.md").read_text()
    listed = re.findall(r"^- \[[^]]+\]\(([a-z-]+)/([a-z-]+)\.md\): \S.*$", index, re.MULTILINE)
    pages = [(path.parent.name, path.stem) for path in (ROOT / "docs").glob("*/*.md")]
    assert sorted(listed) == sorted(pages)
    assert {kind for kind, _ in listed} == {"tutorials", "how-to", "reference", "explanation"}


def test_help_lists_every_target_of_the_makefile() -> None:
    makefile = (ROOT / "Makefile").read_text()
    declared = re.search(r"^\.PHONY: (.*)$", makefile, re.MULTILINE)
    assert declared
    assert set(re.findall(r"^([a-z-]+):.*## ", makefile, re.MULTILINE)) == set(declared[1].split())
