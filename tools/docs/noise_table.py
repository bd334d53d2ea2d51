"""The table of what noise and copies earn in the ready assignment, from the figures of `measure_noise`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tools.docs.figures import measured_on
from tools.docs.templates import table

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    Figures = Mapping[str, Any]

SIGNALS = ("cleaner_than_samples", "noise_without_samples")
"""Signals that noise may give."""

BY_ERROR = "antialiasing_advanced"
"""The scene with a limit of the RMSE, which few or plain random samples miss."""


def of_page(measured: Figures) -> str:
    """The table, and when it was measured."""
    columns = ("pictures", "number", "lose points", *SIGNALS)
    return f"{table(columns, rows(measured))}\n\n{measured_on(measured['machine'])}"


def rows(measured: Figures) -> Iterator[tuple[str, ...]]:
    """Correct pictures by their samples, wrong ones with noise, and copies by the noise added to them."""
    scenes = measured["scenes"]
    by_verdict = {name: found for name, found in scenes.items() if name != BY_ERROR}
    for samples, parts in _grouped(by_verdict, "honest", "samples"):
        lost = sum(part["lost"] for part in parts)
        yield f"correct, {samples} samples", str(len(parts) * measured["seeds"]), str(lost), *_signals(parts)
    wrong = [part for found in scenes.values() for part in found["wrong"]]
    more = sum(len(part["more"]) for part in wrong)
    number = sum(part["pictures"] for part in wrong)
    yield "wrong, with noise added", str(number), f"{more} earn more than without noise", *_signals(wrong)
    for deviation, parts in _grouped(scenes, "copies", "deviation"):
        codes = "code" if deviation == 1 else "codes"
        added = f" with noise of {deviation} {codes}" if deviation else ""
        number = sum(part["pictures"] for part in parts)
        yield f"references in 8 bits{added}", str(number), "not counted", *_signals(parts)


def _grouped(scenes: Figures, kind: str, key: str) -> Iterator[tuple[Any, list[Figures]]]:
    """Parts of all scenes by their value of a key."""
    parts = [part for found in scenes.values() for part in found[kind]]
    for value in dict.fromkeys(part[key] for part in parts):
        yield value, [part for part in parts if part[key] == value]


def _signals(parts: Iterable[Figures]) -> list[str]:
    """Pictures that give each signal."""
    return [str(sum(part["signals"].get(signal, 0) for part in parts)) for signal in SIGNALS]
