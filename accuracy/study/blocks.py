"""What a report is made of, whatever it is written as."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


@dataclass(frozen=True, slots=True)
class Heading:
    """The title of what follows; `level` 1 is that of the report."""

    text: str
    level: int = 2


@dataclass(frozen=True, slots=True)
class Paragraph:
    """Plain text."""

    text: str


@dataclass(frozen=True, slots=True)
class Points:
    """Questions in bold, each with its answer."""

    items: Sequence[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class Table:
    """Rows under headings, all plain text; `grey` are the numbers of rows that matter less."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    grey: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class Plot:
    """A plot: the name of its file, its SVG and what it shows."""

    name: str
    svg: str
    caption: str


@dataclass(frozen=True, slots=True)
class Strip:
    """Pictures side by side, each with its file's name, its PNG and the lines below it."""

    caption: str
    pictures: Sequence[tuple[str, bytes, str]]


Block = Heading | Paragraph | Points | Table | Plot | Strip
