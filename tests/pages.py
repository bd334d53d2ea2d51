"""Pages of the documentation, and what a reader copies from them."""

import re
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"


def page(name: str) -> str:
    """The text of a page, named relative to `docs`."""
    return (DOCS / name).read_text()


def blocks(text: str, language: str) -> list[str]:
    """The fenced blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def missing(name: str, printed: str) -> list[str]:
    """Lines of output that a page shows and its commands did not print; a pipe gets tabs for blanks."""
    shown = blocks(page(name), "text")
    assert shown
    lines = (" ".join(line.split()) for block in shown for line in block.splitlines())
    return [line for line in lines if line not in " ".join(printed.split())]
