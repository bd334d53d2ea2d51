"""Fill measured figures into pages that are written by hand.

Such a page has ``<!-- NAME -->`` and ``<!-- /NAME -->`` around each text that is made of figures. What stands
between them is written anew from the kept figures.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from accuracy.variations import label
from benchmarks import peers_sentences, references
from benchmarks.settings import Setting
from tools.docs import figures, noise_table
from tools.docs.templates import table

ROOT = Path(__file__).parents[2]
MARKED = re.compile(r"<!-- ([a-z-]+) -->(\n?).*?<!-- /\1 -->", re.DOTALL)
"""A name, whether its mark is alone in its line, and what stands between both marks."""
WIDTH = 130

Figures = Mapping[str, Any]


class Text(NamedTuple):
    """What stands between two marks: the names of the figures that it is made of, and how."""

    figures: tuple[str, ...]
    of: Callable[..., str]


def filled(page: str) -> str:
    """Write what stands between the marks of a page.

    Raises
    ------
    MissingFiguresError
        If figures that it needs are not kept.
    KeyError
        If no text has the name of a mark.
    """
    return MARKED.sub(_filled, page)


def _filled(found: re.Match[str]) -> str:
    name, alone = found.groups()
    text = TEXTS[name]
    around = "\n\n" if alone else ""
    return f"<!-- {name} -->{around}{text.of(*map(figures.read, text.figures))}{around}<!-- /{name} -->"


def reference_errors() -> str:
    """Samples and own error of each converged picture, a row each; both are kept beside the picture."""
    kept = ((name, references.read_provenance(name)) for name in references.NAMES)
    rows = [(name, f"{made.samples_per_pixel}", f"{made.own_error_255:.4f}") for name, made in kept]
    return table(("reference", "samples a pixel", "its own error, RMSE x 255"), rows)


def errors(bench: Figures) -> str:
    """Errors of each compared setting of `soft` and of `chess`, and when they were measured."""
    cells: dict[str, list[str]] = {}
    for row in bench["accuracy"]:
        setting = Setting(**row["setting"])
        cells.setdefault(label(setting.quality), []).extend(_errors(row))
    rows = [(name, *errors) for name, errors in cells.items()]
    columns = ("samples", "soft: RMSE", "mean difference", "chess: RMSE", "mean difference")
    return f"{table(columns, rows)}\n\n{figures.measured_on(bench['machine'])}"


def _errors(row: Figures) -> Iterator[str]:
    yield f"{row['rmse_255']:.3f}"
    yield f"{row['mean_difference_255']:+.3f}"


def target_errors(measured: Figures) -> str:
    """How often scenes that led to no change reached their targets, and those that did."""
    fresh, developed = (measured["targets"][name] for name in ("fresh", "developed"))
    low, middle, high = fresh["summary"]["ratios"]
    words = (
        f"{_reached(fresh)} The true error is {middle:.2f} of the target in the median, {low:.2f} to "
        f"{high:.2f} from the 10th to the 90th percentile. {_reached(developed)} Failures of these have led "
        f"to changes of the renderer, so they say less. {figures.measured_on(measured['machine'])}"
    )
    return textwrap.fill(words, WIDTH, break_long_words=False, break_on_hyphens=False)


def _reached(measured: Figures) -> str:
    total = measured["summary"]
    return (
        f"Of the {measured['scenes']} scenes from number {measured['first']}, {total['kept']} of "
        f"{total['pairs']} pictures reached the target, and {total['held']} of {total['pairs']} intervals "
        "contained the true error."
    )


def class_time(measured: Figures) -> str:
    """How long a class takes; empty until it is measured."""
    if "time" not in measured:
        return ""
    time = measured["time"]
    return (
        f"{time['students']} submissions to the ready assignment, {time['right']} of them right, took "
        f"{time['seconds'] / 60:.1f} min and {time['cpu_seconds'] / time['students']:.1f} CPU seconds each. "
        f"{figures.measured_on(time['machine'])}"
    )


def shared_noise(measured: Figures) -> str:
    """How often honest pictures were taken for copies, and how many altered copies were found."""
    measured = measured["noise"]
    honest = [
        (
            each["program"],
            f"{each['pairs']:,}",
            f"{each['alarms']}",
            f"{each['highest']:.2f}",
            f"{each['closest']:.2f}",
        )
        for each in measured["honest"]
    ]
    altered = [(each["how"], f"{each['found']} of {each['copies']}") for each in measured["altered"]]
    width, height = measured["size"]
    width, height = measured["size"]
    words = (
        f"A simple ray tracer that shares no code with this one made pictures of {width} x {height} pixels "
        f"with {measured['samples']} samples, {measured['seeds']} seeds of each program. Wrong programs are "
        f"compared in groups of {measured['minority']}, each in a class of right ones. "
        f"{figures.measured_on(measured['machine'])}"
    )
    columns = ("honest pictures", "pairs", "reported", "highest correlation", "least difference")
    return "\n\n".join(
        (
            textwrap.fill(words, WIDTH, break_long_words=False, break_on_hyphens=False),
            table(columns, honest),
            table(("copies", "reported"), altered),
        )
    )


TEXTS = {
    "class-time": Text(("class",), class_time),
    "peers": Text(("peers",), lambda peers: peers_sentences.of_readme(peers["comparisons"])),
    "noise": Text(("noise",), noise_table.of_page),
    "reference-errors": Text((), reference_errors),
    "errors": Text(("bench",), errors),
    "shared-noise": Text(("class",), shared_noise),
    "target-errors": Text(("targets",), target_errors),
}
"""Texts by the names of their marks."""


def figures_of(page: str) -> tuple[str, ...]:
    """Names of the figures that a page with marks is made of."""
    return tuple(dict.fromkeys(name for found in MARKED.finditer(page) for name in TEXTS[found[1]].figures))


def pages() -> list[Path]:
    """Pages that have marks."""
    known = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
    return [path for path in known if MARKED.search(path.read_text(encoding="utf-8"))]
