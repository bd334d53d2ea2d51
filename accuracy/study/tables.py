"""The results of a study as tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from accuracy.study.pages import Table
from accuracy.study.settings import METHODS
from accuracy.study.words import error, figure, interval

Document = Mapping[str, Any]
Row = Mapping[str, Any]

NONE = "-"

MOST_POINTERS = 3
"""Pointers shown of an effect; `results.json` has all."""


def settings(document: Document) -> Table:
    """All settings, the cheapest first; those not on the front are grey."""
    rows = _by_cost(document["settings"])
    grey = frozenset(number for number, row in enumerate(rows) if not row["front"])
    return _of_settings(document, rows, grey)


def front(document: Document) -> Table:
    """The settings on the front."""
    return _of_settings(document, _by_cost(row for row in document["settings"] if row["front"]))


def _by_cost(rows: Iterable[Row]) -> list[Row]:
    return sorted(rows, key=lambda row: row["cpu_seconds"]["estimate"])


def _of_settings(document: Document, rows: Sequence[Row], grey: frozenset[int] = frozenset()) -> Table:
    own = figure(document["reference"]["rmse_255"])
    return _table(
        rows,
        {
            "setting": lambda row: row["name"],
            "runs": _runs,
            "CPU seconds": _cpu_seconds,
            "rays": lambda row: f"{row['rays']:,.0f}",
            "RMSE x 255": lambda row: interval(row["rmse_255"]),
            "beside edges": lambda row: figure(row["edges_rmse_255"]),
            "elsewhere": lambda row: figure(row["smooth_rmse_255"]),
            "hot pixels": lambda row: f"{100 * row['hot']:.2f} %",
            "reference's own": lambda _: own,
        },
        grey,
    )


def methods(document: Document) -> Table:
    """The order of convergence of each method, and the cost of half the error."""
    return _table(
        document["methods"],
        {
            "method": lambda row: row["method"],
            "settings": lambda row: str(len(row["front"])),
            "order in seconds": lambda row: _maybe(row["order"]),
            "order in rays": lambda row: _maybe(row["order_by_rays"]),
            "half the error takes, times as long": lambda row: _maybe(row["halving"]),
        },
    )


def equal_error(document: Document) -> Table:
    """CPU seconds to the same error, also relative to the fastest method."""
    rows = document["equal_error"]
    names = [name for name in METHODS if any(name in row["ratios"] for row in rows)]
    ratios = {name: partial(_ratio, name=name) for name in names}
    return _table(rows, {"RMSE": lambda row: error(row["rmse_255"])} | ratios)


def precision(document: Document) -> Table:
    """The cost of double precision, and how it changes the picture."""
    return _table(
        document["precision"],
        {
            "setting": lambda row: row["name"],
            "runs": _runs,
            "CPU seconds": _cpu_seconds,
            "times those in single": lambda row: interval(row["ratio"]),
            "changes the picture by": _change,
            "its error": lambda row: error(row["rmse_255"]),
        },
    )


def effects(document: Document) -> Table:
    """The time and the change of the picture without each effect."""
    return _table(
        document["effects"],
        {
            "effect": lambda row: row["effect"],
            "runs": _runs,
            "CPU seconds": _cpu_seconds,
            "share": lambda row: f"{100 * row['share']:.0f} %",
            "changes the picture by": _change,
            "asked for by": pointers,
        },
    )


def pointers(row: Row) -> str:
    """The first few pointers of an effect.

    Examples
    --------
    >>> pointers({"pointers": ["/a", "/b", "/c", "/d"]})
    '/a /b /c and 1 more'
    """
    more = len(row["pointers"]) - MOST_POINTERS
    return " ".join(row["pointers"][:MOST_POINTERS]) + (f" and {more} more" if more > 0 else "")


def _table(
    rows: Iterable[Row], columns: Mapping[str, Callable[[Row], str]], grey: frozenset[int] = frozenset()
) -> Table:
    """A table with a function for the cells of each column."""
    return Table(tuple(columns), [tuple(cell(row) for cell in columns.values()) for row in rows], grey)


def _runs(row: Row) -> str:
    return str(row["runs"])


def _cpu_seconds(row: Row) -> str:
    return interval(row["cpu_seconds"])


def _change(row: Row) -> str:
    return error(row["difference_255"])


def _maybe(value: Mapping[str, Any] | None) -> str:
    return NONE if value is None else interval(value, 2)


def _ratio(row: Row, name: str) -> str:
    if name not in row["ratios"]:
        return NONE
    return f"{figure(row['cpu_seconds'][name])} s, {figure(row['ratios'][name])} x"
