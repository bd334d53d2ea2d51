"""A promise, what was measured of it, and the document and the table of all of them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, TypedDict

from rich.table import Table

from benchmarks.machine import Machine, describe

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


class Promise(TypedDict):
    """A sentence, the figure that was measured, the limit that it is held to, and what else is known."""

    promise: str
    measured: str
    held: bool
    limit: str
    details: dict[str, Any]


class Report(TypedDict):
    """All promises, and on what they were measured."""

    date: str
    machine: Machine
    promises: list[Promise]


def promise(sentence: str, measured: str, *, held: bool, limit: str, **details: Any) -> Promise:
    """Make an entry of the report."""
    return Promise(promise=sentence, measured=measured, held=held, limit=limit, details=details)


def write(promises: Sequence[Promise], path: Path) -> Report:
    """Keep all promises as a JSON document."""
    machine = describe()
    report = Report(date=machine["date"], machine=machine, promises=list(promises))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(report, indent=2) + "\n")
    return report


def table(promises: Sequence[Promise], title: str) -> Table:
    """Lay promises out for a terminal."""
    made = Table("promise", "measured", "limit", "held", title=title)
    for one in promises:
        made.add_row(one["promise"], one["measured"], one["limit"], "yes" if one["held"] else "NO")
    return made
