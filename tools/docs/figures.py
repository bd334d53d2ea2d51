"""Measured figures: the files that pages are written from, and the command that makes each of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

FOLDER = Path(__file__).parents[2] / "docs" / "figures"


class MissingFiguresError(SystemExit):
    """A page cannot be written, as its figures are not kept: the script ends with this message."""


def read(name: str) -> Any:
    """Give the figures of a name, or say how to measure them.

    Raises
    ------
    MissingFiguresError
        If they are not kept. The message has the command that measures them.
    """
    path = FOLDER / f"{name}.json"
    if not path.exists():
        raise MissingFiguresError(f"docs/figures/{path.name} is missing")
    return json.loads(path.read_text(encoding="utf-8"))


def measured_on(machine: Mapping[str, Any], beside: Iterable[str] = ()) -> str:
    """Say when and on what figures were measured; `beside` are other programs with their versions."""
    numpy = [f"NumPy {machine['numpy']}"] if "numpy" in machine else []
    *others, last = [*beside, f"Python {machine['python']}", *numpy]
    programs = f"{', '.join(others)} and {last}" if others else last
    on = f"{machine['date'][:10]} on {machine['cores']} cores of {machine['cpu']}"
    load = f" The load before it began was {machine['load']:g}." if "load" in machine else ""
    return f"Measured on {on} with {programs}.{load}"
