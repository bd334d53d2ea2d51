"""``penumbra doctor --numerics``: runs the hard cases and counts wrong answers."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import typer

from service.cli import output
from service.cli.errors import CommandError, ExitCode
from service.cli.progress import progress_bar

if TYPE_CHECKING:
    from rich.table import Table

    from accuracy.hard_cases import Outcome, Section
    from service.cli.trials import Trial

MOST_WORKERS = 2
"""Two halve the time; more would take cores from other programs."""

COUNTS = ("tried", "wrong", "textbook", "textbook_single", "worst")
NOT_ASKED = "–"
HEADINGS = ("Id", "Case", "Tried", "Wrong\nhere", "Textbook\nfloat64", "Textbook\nfloat32", "CPU\nseconds")


def check_numerics(*, as_json: bool) -> None:
    """Try every hard case and show the outcomes; typer.Exit where an answer was wrong."""
    found = list(_with_progress(catalogue()))
    if as_json:
        output.document(as_document(found))
    else:
        show(found)
    if not all(trial.right for trial in found):
        raise typer.Exit(ExitCode.BELOW_THRESHOLD)


def catalogue() -> tuple[Section, ...]:
    """All sections of hard cases; CommandError where the package for exact answers is missing."""
    try:
        from accuracy.hard_cases import sections

        return sections()
    except ModuleNotFoundError as error:
        raise CommandError(
            f"The exact answers need the package {error.name}. "
            "Install it with: pip install 'penumbra-render[numerics]'"
        ) from error


def as_document(trials: Sequence[Trial]) -> dict[str, Any]:
    """The document of ``--json``: every case in its order, and their sum."""
    return {"cases": [_entry(trial) for trial in trials], "total": _total(trials)}


def _entry(trial: Trial) -> dict[str, Any]:
    counts = asdict(trial.outcome) if trial.outcome else dict.fromkeys(COUNTS)
    named = {"ids": list(trial.ids), "section": trial.section, "name": trial.case, "right": trial.right}
    return named | counts | {"error": trial.error or None, "seconds": round(trial.seconds, 3)}


def _total(trials: Sequence[Trial]) -> dict[str, Any]:
    from accuracy.hard_cases.harness import total

    counts = asdict(total(trial.outcome for trial in trials if trial.outcome))
    cases = {"cases": len(trials), "right": sum(trial.right for trial in trials)}
    return cases | counts | {"seconds": round(sum(trial.seconds for trial in trials), 3)}


def _with_progress(known: Sequence[Section]) -> Iterator[Trial]:
    from service.cli import trials

    workers = min(MOST_WORKERS, len(os.sched_getaffinity(0)))
    places = trials.places_of(known)
    results = trials.in_processes(places, workers) if workers > 1 else trials.one_after_another(known)
    with progress_bar("Hard cases") as bar:
        for done, trial in enumerate(results, start=1):
            bar.show(done / len(places), trial.case)
            yield trial


def show(trials: Sequence[Trial]) -> None:
    """Print every case, what is wrong, and the sum: a table on a terminal, a line a case elsewhere."""
    if output.on_terminal():
        output.show(_table(trials))
    else:
        for trial in trials:
            output.result("\t".join([trial.section, *_cells(trial)]))
    for line in _closing(trials):
        output.result(line)


def _table(trials: Sequence[Trial]) -> Table:
    table = output.table(HEADINGS, (), numbers=HEADINGS[2:])
    section = ""
    for trial in trials:
        if trial.section != section:
            section = trial.section
            table.add_row("", section, style="bold")
        table.add_row(*_cells(trial), style=None if trial.right else "red")
    return table


def _cells(trial: Trial) -> tuple[str, ...]:
    return (_ids(trial), trial.case, *_counts(trial.outcome), f"{trial.seconds:.2f}")


def _ids(trial: Trial) -> str:
    return ", ".join(trial.ids)


def _counts(outcome: Outcome | None) -> Iterable[str]:
    if outcome is None:
        return (NOT_ASKED, "failed", NOT_ASKED, NOT_ASKED)
    counts = (outcome.tried, outcome.wrong, outcome.textbook, outcome.textbook_single)
    return (NOT_ASKED if count is None else f"{count:,}" for count in counts)


def _closing(trials: Sequence[Trial]) -> Iterator[str]:
    """The wrong cases once more, with their errors, and the sum last."""
    for trial in trials:
        if not trial.right:
            place = f"{_ids(trial)} {trial.section}: {trial.case}"
            yield f"{output.emphasis('wrong', 'red')} {place}: {_fault(trial)}"
    total = _total(trials)
    wrong = total["cases"] - total["right"]
    verdict = output.emphasis(f"{wrong} wrong", "red") if wrong else output.emphasis("all right", "green")
    size = f"{total['cases']} cases, {total['tried']:,} answers, {total['seconds']:.0f} CPU seconds"
    yield f"{size}: {verdict}."
    plain = [total["textbook"] or 0, total["textbook_single"] or 0]
    yield f"Textbook formulas got {plain[0]:,} wrong in float64 and {plain[1]:,} in float32."


def _fault(trial: Trial) -> str:
    if trial.outcome is None:
        return trial.error
    return f"{trial.outcome.wrong:,} of {trial.outcome.tried:,} answers"
