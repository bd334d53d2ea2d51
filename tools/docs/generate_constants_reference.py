"""Write docs/reference/constants.md from the constants of target quality.

Run it with ``python tools/docs/generate_constants_reference.py``.
"""

from __future__ import annotations

import ast
import importlib
import inspect
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "constants.md"

PACKAGE = "renderer.adaptive"

MODULES = (
    "levels",
    "lattice",
    "early_passes",
    "guides",
    "coverage",
    "strata",
    "findings",
    "uncertainty",
    "allocation",
    "estimate",
    "decisions",
    "between",
    "blur",
    "blur_decisions",
    "forecast",
    "partition",
    "time_limits",
)
"""In the order in which a picture uses them."""

INTRODUCTION = """# Constants of target quality

The numbers that [target quality](../explanation/target-quality.md) decides by, where they stand in the code,
and the measurement or the bound behind each. Where a row gives neither, none was kept: the value is a choice.
What all of them together lead to is measured by `python -m benchmarks targets`: how often pictures reach
the target error, and how far below it they are ([how we know](../explanation/accuracy.md)).

Scenes named are those of the gallery. Levels count samples by powers of two, as `levels.py` says; the
budget is the sum of squared errors that the target allows.
`python tools/docs/generate_constants_reference.py` writes this page.
"""


class Constant(NamedTuple):
    """A constant of a module, or several in one statement."""

    name: str
    value: str
    meaning: str


def page() -> str:
    """Put the whole page together."""
    return "\n".join([INTRODUCTION, *(section(module) for module in MODULES)])


def section(module: str) -> str:
    """Describe the constants of a module, one a row."""
    head = (inspect.getdoc(importlib.import_module(f"{PACKAGE}.{module}")) or "").splitlines()[0]
    rows = [f"| `{name}` | `{value}` | {meaning} |" for name, value, meaning in constants(module)]
    table = "\n".join(["| constant | value | meaning |", "| --- | --- | --- |", *rows])
    return f"## {module}.py\n\n{head}\n\n{table}\n"


def constants(module: str) -> Iterator[Constant]:
    """Find the constants of a module that are numbers, with the text that follows each."""
    loaded = importlib.import_module(f"{PACKAGE}.{module}")
    source = inspect.getsource(loaded)
    body = ast.parse(source).body
    for statement, after in zip(body, [*body[1:], None], strict=True):
        if isinstance(statement, ast.Assign):
            name = ast.unparse(statement.targets[0]).strip("()")
            if all(is_number(getattr(loaded, part, None)) for part in name.split(", ")) and name[0] != "_":
                value = ast.get_source_segment(source, statement.value) or ""
                yield Constant(name, " ".join(value.split()), text(after))


def is_number(value: object) -> bool:
    """Whether a constant is a number, or several in a tuple."""
    if isinstance(value, tuple):
        return all(map(is_number, value))
    return isinstance(value, int | float | np.number)


def text(statement: ast.stmt | None) -> str:
    """The string that documents the constant before it, in one line; nothing if there is none."""
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return " ".join(str(statement.value.value).split())
    return ""


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
