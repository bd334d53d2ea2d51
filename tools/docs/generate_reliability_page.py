"""Write docs/explanation/reliability.md from what `make chaos` and `make load` left in out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
MEASURED = ROOT / "out"
PAGE = ROOT / "docs" / "explanation" / "reliability.md"
TEMPLATE = Path(__file__).with_name("reliability_template.txt")
HEAD = "| promise | measured | limit | held |\n| --- | --- | --- | --- |"


def page(folder: Path = MEASURED) -> str:
    """The template with the tables in their places."""
    return TEMPLATE.read_text().format(
        **{name: measured_or_missing(folder / f"{name}.json") for name in ("chaos", "load")}
    )


def measured_or_missing(path: Path) -> str:
    """The results of a command, or which one to run."""
    if not path.exists():
        return f"Not measured yet: `make {path.stem}` does."
    return section(json.loads(path.read_text()))


def section(measured: dict[str, Any]) -> str:
    """A table in Markdown, and on what it was measured."""
    machine = measured["machine"]
    rows = [
        "| "
        + " | ".join(
            [found["promise"], found["measured"], found["limit"], "yes |" if found["held"] else "**no** |"]
        )
        for found in measured["promises"]
    ]
    where = f"Measured on {machine['date'][:10]} on {machine['cores']} cores of {machine['cpu']}"
    return "\n".join([HEAD, *rows, "", f"{where} with Python {machine['python']}."])


if __name__ == "__main__":
    PAGE.write_text(page())
