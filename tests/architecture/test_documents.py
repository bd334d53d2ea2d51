"""What is written about the project is true of it, and speaks of the project alone."""

import re
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest
from typer.main import get_group

from service.cli.commands import application
from tests.architecture.sources import ROOT, text_files
from tools.docs import site_hooks

PAGES = [path for path in text_files() if path.suffix == ".md"]
BLOCK = re.compile(r"^```(?:sh|console|bash)\n(.*?)^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")
FENCED = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"(?<![\w/.-])(?:tools/)?docs/[\w/-]+\.(?:md|py|txt|toml)\b")
"""What a text calls by its path: a page, the script that writes it, or what that script reads."""
# A package index is the user's choice; a home folder is one person's.
ONE_MACHINE = re.compile(r"pythonhosted|index[-_]url|/home/\w|/Users/\w|/root/\w")


def links(path: Path) -> list[str]:
    """Relative links of a page."""
    found = LINK.findall(FENCED.sub("", (ROOT / path).read_text()))
    return [link for link in found if not re.match(r"[a-z]+:", link)]


@cache
def anchors(path: Path) -> set[str]:
    """Fragments that the headings of a page are reached by."""
    slugs = site_hooks.Slugs()
    tokens = site_hooks.FORGE.parse(path.read_text())
    headings = [after for before, after in pairwise(tokens) if before.type == "heading_open"]
    texts = ("".join(part.content for part in heading.children or []) for heading in headings)
    return {slugs(text, "-") for text in texts}


def test_no_file_names_a_folder_of_one_machine_or_a_package_index() -> None:
    texts = {path: (ROOT / path).read_text() for path in text_files() if path.name != Path(__file__).name}
    assert [path for path, text in texts.items() if ONE_MACHINE.search(text) or str(ROOT) in text] == []


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


def test_a_page_or_a_script_that_a_file_names_is_there() -> None:
    named = ((path, match) for path in text_files() for match in NAMED.findall((ROOT / path).read_text()))
    assert [(path, match) for path, match in named if not (ROOT / match).exists()] == []


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
