"""Grade 24 whole wrong programs by the ready manifest: points lost, the causes named, and the goal.

``python -m tools.docs.measure_programs`` grades all of them, one process per core, which takes some minutes,
saves them in docs/figures/assignment.json, and writes the page. The verdicts and how far they are from the
goal are printed; the status is 0 even where the goal is missed. Names of programs after it grade only those,
and save nothing.
"""

from __future__ import annotations

import json
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from accuracy.study.journal import describe
from tests.service.grading.assignment import program
from tests.service.grading.assignment.programs import PROGRAMS, Program, reached
from tools.docs import generate_assignment_page as assignment
from tools.docs.figures import read

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from schemas.grading.grades import TestGrade


def main() -> None:
    """Grade the programs named on the command line and print them, or grade, print and save all."""
    names = sys.argv[1:]
    found = measure(chosen(names))
    print("\n".join(map(line, found)))
    if not names:
        print(reached(each["verdict"] for each in found))
        save(found)


def chosen(names: Sequence[str]) -> list[Program]:
    """The programs of these names, or all of them."""
    known = {each.name: each for each in PROGRAMS}
    unknown = [name for name in names if name not in known]
    if unknown:
        raise SystemExit(f"There is no program {unknown[0]!r}. The names are {', '.join(known)}.")
    return [known[name] for name in names] or list(PROGRAMS)


def measure(programs: Sequence[Program]) -> list[dict[str, Any]]:
    """Run and grade programs in parallel."""
    with tempfile.TemporaryDirectory() as place, ProcessPoolExecutor() as pool:
        return list(pool.map(partial(graded, Path(place)), programs))


def graded(folder: Path, wrong: Program) -> dict[str, Any]:
    """Run a program in a folder, and grade what it wrote."""
    place, manifest = folder / wrong.name, assignment.ready_manifest()
    program.run(assignment.ASSIGNMENT, place, frozenset([wrong.name]))
    found = assignment.graded(manifest, place)
    advice = {test.id: test.advice or "" for test in manifest.tests}
    lost = [part(test, advice[test.id]) for test in found.tests if test.points < test.max_points]
    return {
        "name": wrong.name,
        "words": wrong.words,
        "points_lost": sum(each["points"] for each in lost),
        "verdict": wrong.verdict(lost),
        "named": named(lost),
        "lost": lost,
        "cpu_seconds": round(found.timings.cpu_seconds, 1),
    }


def part(test: TestGrade, advice: str) -> dict[str, Any]:
    """What a test took, and why."""
    return {
        "test": test.id,
        "points": test.max_points - test.points,
        "cause": test.diagnosis[0].cause if test.diagnosis else None,
        "message": assignment.message_of(test, advice),
    }


def named(lost: Sequence[Mapping[str, Any]]) -> list[str]:
    """Causes, and advice about rays, each once."""
    causes = [f"`{each['cause']}`" for each in lost if each["cause"]]
    advice = [each["message"] for each in lost if each["test"].startswith("rays-") and each["message"]]
    return list(dict.fromkeys(causes + advice))


def line(found: Mapping[str, Any]) -> str:
    """A program in one line."""
    causes = ", ".join(found["named"]) or "no cause found"
    return f"{found['name']:20} {found['points_lost']:5g} points lost   {found['verdict']:5}   {causes}"


def save(found: list[dict[str, Any]]) -> None:
    """Keep the figures beside those of single mistakes, and write the page from them."""
    figures = read("assignment") | {"programs": {"machine": describe(), "programs": found}}
    assignment.FIGURES.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    assignment.PAGE.write_text(assignment.page(figures), encoding="utf-8")


if __name__ == "__main__":
    main()
