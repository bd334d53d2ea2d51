"""What is written about the project is true of it, and speaks of the project alone."""

import re
from pathlib import Path

import pytest
from typer.main import get_group

from service.cli.commands import application
from tests.architecture.sources import ROOT, text_files

PAGES = [path for path in text_files() if path.suffix == ".md"]
BLOCK = re.compile(r"^```(?:sh|console|bash)\n(.*?)^```", re.MULTILINE | re.DOTALL)
# A package index is the user's choice; a home folder is one person's.
ONE_MACHINE = re.compile(r"pythonhosted|index[-_]url|/home/\w|/Users/\w|/root/\w")


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
def test_a_page_links_to_files_that_are_there(path: Path) -> None:
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", (ROOT / path).read_text())
    missing = [link for link in links if not (ROOT / path.parent / link).exists()]
    assert missing == []


def test_help_lists_every_target_of_the_makefile() -> None:
    makefile = (ROOT / "Makefile").read_text()
    declared = re.search(r"^\.PHONY: (.*)$", makefile, re.MULTILINE)
    assert declared
    assert set(re.findall(r"^([a-z-]+):.*## ", makefile, re.MULTILINE)) == set(declared[1].split())
