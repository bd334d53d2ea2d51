"""Write docs/reference/constants.md from the constants of target quality."""

from __future__ import annotations

import ast
import importlib
import inspect
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tools.docs.templates import table

if TYPE_CHECKING:
    from collections.abc import Iterator

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "constants.md"

PACKAGE = "renderer.adaptive"

STAGES = {
    "Pilot samples and borders": ("levels", "lattice", "early_passes", "guides", "coverage"),
    "Strata, probes and the error": ("strata", "findings", "uncertainty"),
    "Decisions about samples": ("allocation", "aims", "decisions"),
    "Pictures through a lens": ("between", "blur", "blur_decisions"),
    "Progress, tiles and time": ("forecast", "partition", "time_limits"),
}
"""Modules by what they decide, in the order in which a picture uses them."""

MODULES = tuple(module for modules in STAGES.values() for module in modules)

LONG = 60
"""Characters of a value that a row has space for: a series is shown by its ends."""

COLUMNS = ("constant", "value", "meaning")

INTRODUCTION = """# Constants of target quality

<!-- Written by tools/docs/generate_constants_reference.py from renderer/adaptive. Change those modules. -->

The numbers by which [target quality](../explanation/target-quality.md) decides, each with the measurement or
the bound behind it; without either, the value is a choice. You never set them. Look here when you read the
code, when a picture got more passes, probes or samples than you expected, or before you change one. After a
change, run `python -m benchmarks targets`: it measures how often pictures reach the target error, and how far
below it they are ([how we know](../explanation/accuracy.md)).

Levels count samples by powers of two. The budget is the sum of squared errors that the target allows. A find
is a probe whose error is far above the expected one. Other words are in the [glossary](glossary.md). `soft`,
`chess` and `lamp` are scenes of `scenes/study`.
"""


class Constant(NamedTuple):
    """A constant of a module, or several in one statement."""

    name: str
    value: str
    meaning: str


def page() -> str:
    """Put the whole page together."""
    stages = ("\n".join([f"## {title}\n", *map(section, modules)]) for title, modules in STAGES.items())
    return "\n".join([INTRODUCTION, *stages])


def section(module: str) -> str:
    """Describe the constants of a module, one a row."""
    head = (inspect.getdoc(importlib.import_module(f"{PACKAGE}.{module}")) or "").splitlines()[0]
    rows = ((f"`{name}`", f"`{value}`", meaning) for name, value, meaning in constants(module))
    path = f"{PACKAGE.replace('.', '/')}/{module}.py"
    return f"### {module}.py\n\n{head} [Source](../../{path})\n\n{table(COLUMNS, rows)}\n"


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
                yield Constant(name, shortened(" ".join(value.split())), text(after))


def shortened(value: str) -> str:
    """A value, or the ends of a long series."""
    if len(value) <= LONG:
        return value
    parts = value.strip("(), ").split(", ")
    return f"{', '.join(parts[:3])}, ..., {parts[-1]}"


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
