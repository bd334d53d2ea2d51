"""Write docs/reference/assignment.md from the grades of right and wrong submissions to the ready assignment.

``python -m tools.docs.generate_assignment_page --measure`` grades all of them, which takes some minutes, and
saves the figures in docs. Names of mistakes after the option grade only those. Without the option the page is
written from the saved figures.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from accuracy.study.journal import describe
from schemas.grading.manifest_reading import read_manifest
from service.grading.grading import grade
from service.grading.mistakes.hints import HINTS
from tests.service.grading.assignment import submissions
from tests.service.grading.assignment.mistakes import MISTAKES
from tests.service.grading.assignment.programs import reached
from tools.docs.figures import FOLDER, measured_on, read
from tools.docs.templates import table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from schemas.grading.grades import Grade, TestGrade
    from schemas.grading.manifests import Manifest
    from tests.service.grading.assignment.mistakes import Mistake

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
ASSIGNMENT = ROOT / "scenes" / "assignment"
MANIFEST = ASSIGNMENT / "manifest.yaml"
PAGE = DOCS / "reference" / "assignment.md"
TEMPLATE = Path(__file__).with_name("assignment_template.txt")
PROGRAMS_TEMPLATE = Path(__file__).with_name("programs_template.txt")
FIGURES = FOLDER / "assignment.json"

SAMPLES = (4, 16, 64)
"""Samples per pixel of the correct submissions."""

SEEDS = (1, 2)
"""Seeds of the correct submissions with each number of samples."""

RIGHT = "right"
"""The name that grades the correct submissions again."""

DEADLINE = 3600.0
"""Deadline of a test during measurements, seconds: on a busy machine all mistakes are still tried."""

NUMBERS = re.compile(r"^\d+ of \d+ rays agree.*?They differ in: [^.]*\. |Of these rays .*$")
"""Parts of the message about rays that hold counts or an example row."""


def main() -> None:
    """Measure the submissions named on the command line, and write the page."""
    if "--measure" in sys.argv[1:]:
        measure(sys.argv[2:])
    PAGE.write_text(page(read("assignment")), encoding="utf-8")
    print(f"wrote {PAGE}")


def measure(names: Sequence[str]) -> None:
    """Grade the mistakes of these names, `right`, or everything, one process per core."""
    whole = not names or RIGHT in names
    settings = [(samples, seed) for samples in SAMPLES for seed in SEEDS if whole]
    chosen = [mistake for mistake in MISTAKES if not names or mistake.name in names]
    with tempfile.TemporaryDirectory() as place, ProcessPoolExecutor() as pool:
        mapped = pool.map(partial(_right, Path(place)), settings)
        wrong = list(pool.map(partial(_wrong, Path(place)), chosen))
        right = list(mapped)
    kept = read("assignment") if names or FIGURES.exists() else {}
    if not names:
        kept |= {"machine": describe(), "right": [], "wrong": []}
    found = {part["name"]: part for part in (*kept["wrong"], *wrong)}
    figures = {
        "machine": kept["machine"],
        "right": right if whole else kept["right"],
        "wrong": [found[mistake.name] for mistake in MISTAKES if mistake.name in found],
    }
    # Whole programs are graded by tools.docs.measure_programs.
    if "programs" in kept:
        figures["programs"] = kept["programs"]
    FIGURES.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


def _right(folder: Path, setting: tuple[int, int]) -> dict[str, Any]:
    samples, seed = setting
    place = folder / f"right-{samples}-{seed}"
    submissions.write(place, samples=samples, seed=seed)
    found = graded(ready_manifest(), place)
    print(f"right with {samples} samples, seed {seed}: {found.score:g}", flush=True)
    return {
        "samples": samples,
        "seed": seed,
        "score": found.score,
        "cpu_seconds": round(found.timings.cpu_seconds, 1),
        "tests": {
            test.id: {"value": test.value, "threshold": test.threshold, "points": test.points}
            for test in found.tests
        },
    }


def ready_manifest() -> Manifest:
    """The manifest with ray tables."""
    return read_manifest(MANIFEST.read_bytes(), yaml=True)


def _wrong(folder: Path, mistake: Mistake) -> dict[str, Any]:
    """Grade the files that the mistake can change; all others equal those of the correct submission."""
    place, manifest = folder / mistake.name, ready_manifest()
    place.mkdir()
    for name in mistake.touches:
        submissions.save(place, name, frozenset([mistake.name]))
    touched = {name.replace("_", "-") for name in mistake.touches}
    tests = tuple(test for test in manifest.tests if test.id in touched)
    found = graded(manifest.model_copy(update={"tests": tests}), place)
    lost = [test for test in found.tests if test.points < test.max_points]
    advice = {test.id: test.advice for test in tests}
    print(f"{mistake.name}: {', '.join(test.id for test in lost)}", flush=True)
    return {
        "name": mistake.name,
        "words": mistake.words,
        "lost": [
            {
                "test": test.id,
                "points": test.max_points - test.points,
                "message": message_of(test, advice[test.id] or ""),
            }
            for test in lost
        ],
        "cpu_seconds": round(found.timings.cpu_seconds, 1),
    }


def message_of(test: TestGrade, advice: str) -> str:
    """The message to a student, without numbers and without the advice of the manifest."""
    if test.diagnosis:
        return f"**{test.diagnosis[0].cause}**: {test.diagnosis[0].hint}"
    return NUMBERS.sub("", test.message.removesuffix(advice).strip()).strip()


def graded(manifest: Manifest, submission: Path) -> Grade:
    """Grade a folder so that every mistake is tried, however busy the machine is."""
    unhurried = manifest.model_copy(update={"deadline": DEADLINE})
    return grade(unhurried, references=ASSIGNMENT, submission=submission).grade


def page(figures: Mapping[str, Any]) -> str:
    """Fill the tables into the template."""
    manifest = ready_manifest()
    right = figures["right"]
    full = sum(test.points for test in manifest.tests)
    errors = json.loads((ASSIGNMENT / "references" / "errors.json").read_text())
    return TEMPLATE.read_text(encoding="utf-8").format(
        tests=table(
            ("test", "points", "file", "topic"),
            [
                (
                    f"`{test.id}`",
                    f"{test.points:g}{' bonus' if test.bonus else ''}",
                    f"`{test.submitted.file}`",
                    test.name,
                )
                for test in manifest.tests
            ],
        ),
        charges="\n".join(_charges(manifest)),
        scores="; ".join(_scores(right, samples) for samples in SAMPLES),
        full=f"{full:g}",
        right=table(("test", "limit", *(f"{samples} samples" for samples in SAMPLES)), _values(right)),
        wrong=table(("mistake", "points lost", "message"), map(_row, figures["wrong"])),
        programs=_programs(figures.get("programs")),
        seeds=len(SEEDS),
        causes=table(("cause", "hint"), [(f"`{c}`", hint.format("…")) for c, hint in HINTS.items()]),
        largest_error=f"{max(errors.values()):.4f}",
        right_seconds=f"{max(row['cpu_seconds'] for row in right):.0f}",
        machine=measured_on(figures["machine"]),
        wrong_seconds=f"{max(row['cpu_seconds'] for row in figures['wrong']):.0f}",
    )


def _charges(manifest: Manifest) -> Iterator[str]:
    """Rows of the mistakes that are charged once."""
    for charge in manifest.charged_once:
        kinds, tests = (", ".join(f"`{name}`" for name in names) for names in (charge.mistakes, charge.tests))
        yield f"| {kinds} | {tests} |"


def _programs(measured: Mapping[str, Any] | None) -> str:
    """The section about whole wrong programs; empty until they are graded."""
    if measured is None:
        return ""
    rows = (
        (
            program["words"],
            f"{program['points_lost']:g}",
            "<br>".join(program["named"]) or "no cause found",
            program["verdict"],
        )
        for program in measured["programs"]
    )
    shown = table(("mistake", "points lost", "named", "verdict"), rows)
    goal = reached(program["verdict"] for program in measured["programs"])
    section = PROGRAMS_TEMPLATE.read_text(encoding="utf-8")
    return section.format(programs=shown, goal=goal, machine=measured_on(measured["machine"]))


def _scores(right: Sequence[Mapping[str, Any]], samples: int) -> str:
    scores = {row["score"] for row in right if row["samples"] == samples}
    return f"{samples} samples, {' or '.join(f'{score:g}' for score in sorted(scores))}"


def _values(right: Sequence[Mapping[str, Any]]) -> Iterator[Sequence[str]]:
    """For each test the worst value over all seeds, one column per number of samples."""
    for test in right[0]["tests"]:
        rows = {samples: [r["tests"][test] for r in right if r["samples"] == samples] for samples in SAMPLES}
        worst = max if test.split("-")[0] != "rays" else min
        limit = rows[SAMPLES[0]][0]["threshold"]
        yield (f"`{test}`", f"{limit:g}", *(f"{worst(r['value'] for r in of):.3g}" for of in rows.values()))


def _row(wrong: Mapping[str, Any]) -> Sequence[str]:
    lost = ", ".join(f"`{part['test']}` {part['points']:g}" for part in wrong["lost"])
    return (
        wrong["words"],
        lost or "nothing",
        "<br>".join(dict.fromkeys(part["message"] for part in wrong["lost"])),
    )


if __name__ == "__main__":
    main()
