"""The results of a study as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from accuracy.study.pages import Table
from accuracy.study.settings import METHODS
from accuracy.study.words import error, figure, interval

Document = Mapping[str, Any]

NONE = "-"

MOST_POINTERS = 3
"""Of an effect; `results.json` has all."""

SETTING_COLUMNS = (
    "setting",
    "runs",
    "CPU seconds",
    "rays",
    "RMSE x 255",
    "beside edges",
    "elsewhere",
    "hot pixels",
    "reference's own",
)


def settings(document: Document) -> Table:
    """Every setting, the cheapest first, those that another one beats in grey."""
    rows = sorted(document["settings"], key=lambda row: row["cpu_seconds"]["estimate"])
    own = figure(document["reference"]["rmse_255"])
    return Table(
        SETTING_COLUMNS,
        [_setting(row, own) for row in rows],
        frozenset(number for number, row in enumerate(rows) if not row["front"]),
    )


def front(document: Document) -> Table:
    """The settings that nothing beats."""
    rows = sorted(
        (row for row in document["settings"] if row["front"]), key=lambda row: row["cpu_seconds"]["estimate"]
    )
    own = figure(document["reference"]["rmse_255"])
    return Table(SETTING_COLUMNS, [_setting(row, own) for row in rows])


def methods(document: Document) -> Table:
    """How fast the error of each method falls, and what half of it costs."""
    return Table(
        ("method", "settings", "order in seconds", "order in rays", "half the error takes, times as long"),
        [
            (
                row["method"],
                str(len(row["front"])),
                _maybe(row["order"]),
                _maybe(row["order_by_rays"]),
                _maybe(row["halving"]),
            )
            for row in document["methods"]
        ],
    )


def equal_error(document: Document) -> Table:
    """CPU seconds to the same error, and how many times those of the quickest method they are."""
    names = [name for name in METHODS if any(name in row["ratios"] for row in document["equal_error"])]
    return Table(
        ("RMSE", *names),
        [(error(row["rmse_255"]), *(_ratio(row, name) for name in names)) for row in document["equal_error"]],
    )


def precision(document: Document) -> Table:
    """What double precision costs and changes."""
    return Table(
        ("setting", "runs", "CPU seconds", "times those in single", "changes the picture by", "its error"),
        [
            (
                row["name"],
                str(row["runs"]),
                interval(row["cpu_seconds"]),
                interval(row["ratio"]),
                error(row["difference_255"]),
                error(row["rmse_255"]),
            )
            for row in document["precision"]
        ],
    )


def effects(document: Document) -> Table:
    """What goes when an effect goes."""
    return Table(
        ("effect", "runs", "CPU seconds", "share", "changes the picture by", "asked for by"),
        [
            (
                row["effect"],
                str(row["runs"]),
                interval(row["cpu_seconds"]),
                f"{row['share']:.0%}",
                error(row["difference_255"]),
                pointers(row),
            )
            for row in document["effects"]
        ],
    )


def pointers(row: Mapping[str, Any]) -> str:
    """The first few pointers of an effect.

    Examples
    --------
    >>> pointers({"pointers": ["/a", "/b", "/c", "/d"]})
    '/a /b /c and 1 more'
    """
    more = len(row["pointers"]) - MOST_POINTERS
    return " ".join(row["pointers"][:MOST_POINTERS]) + (f" and {more} more" if more > 0 else "")


def _setting(row: Mapping[str, Any], own: str) -> Sequence[str]:
    return (
        row["name"],
        str(row["runs"]),
        interval(row["cpu_seconds"]),
        f"{row['rays']:,.0f}",
        interval(row["rmse_255"]),
        figure(row["edges_rmse_255"]),
        figure(row["smooth_rmse_255"]),
        f"{row['hot']:.2%}",
        own,
    )


def _maybe(value: Mapping[str, Any] | None) -> str:
    return NONE if value is None else interval(value, 2)


def _ratio(row: Mapping[str, Any], name: str) -> str:
    if name not in row["ratios"]:
        return NONE
    return f"{figure(row['cpu_seconds'][name])} s, {figure(row['ratios'][name])} x"
