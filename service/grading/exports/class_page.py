"""A page that sums up a class: points, causes and links, one HTML file without scripts or other resources."""

from __future__ import annotations

import statistics
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

from schemas.grading.classes import ClassEntry, ClassGrade
from schemas.grading.grades import Grade, TestGrade
from service.grading.exports.page import POLICY, STYLE, words
from service.grading.exports.rows import OPEN, WORDS
from service.grading.exports.texts import line, number

BINS = 10
"""Bars of the histogram; points beyond the full score are in the last one."""

BAR, HEIGHT, LABELS = 56, 120, 18
"""Width of a bar, height of the highest one, and room for a line of labels, in pixels."""

UNEXPLAINED = "no cause found"

MORE_STYLE = """
.bars rect { fill: #28c; stroke: none; }
.bars text { font-size: 12px; fill: currentColor; text-anchor: middle; }
"""


def class_page(whole: ClassGrade, grades: Mapping[str, Grade], page: str) -> bytes:
    """The page for staff.

    Parameters
    ----------
    grades
        The result of each student, by name.
    page
        Name of the page in the folder of each student.
    """
    title = words(line(whole.title))
    parts = [
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{title}</title>',
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
        '<meta name="viewport" content="width=device-width">',
        f"<style>{STYLE}{MORE_STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>",
        *_summary(whole),
        *_causes(whole, grades, page),
        *_shared(whole, page),
        *_students(whole, page),
        "</body>\n</html>\n",
    ]
    return "\n".join(parts).encode()


def histogram(scores: Sequence[float], full: float) -> list[int]:
    """How many scores lie in each of `BINS` equal parts of the full score.

    >>> histogram([0, 9.99, 10, 55, 100, 125], 100)
    [2, 1, 0, 0, 0, 1, 0, 0, 0, 2]
    """
    counts = [0] * BINS
    for score in scores:
        counts[BINS - 1 if score >= full else int(BINS * score / full)] += 1
    return counts


def _summary(whole: ClassGrade) -> Iterator[str]:
    complete = [entry.score for entry in whole.students if not entry.ungraded]
    left = len(whole.students) - len(complete)
    middle = f", median {number(statistics.median(complete))}" if complete else ""
    yield (
        f"<p><strong>{len(whole.students)} submissions, {number(whole.max_score)} points{middle}."
        f"</strong> {left} with tests that could not be graded.</p>"
    )
    if complete and whole.max_score > 0:
        yield "<h2>Points of submissions that are graded completely</h2>"
        yield _drawn(histogram(complete, whole.max_score), whole.max_score)


def _drawn(counts: Sequence[int], full: float) -> str:
    bars = "".join(_bar(place, count / max(counts), count, full) for place, count in enumerate(counts))
    wide, tall = BAR * len(counts), HEIGHT + 2 * LABELS
    said = ", ".join(f"{number(full * place / BINS)}+: {count}" for place, count in enumerate(counts))
    return (
        f'<svg class="bars" viewBox="0 0 {wide} {tall}" style="max-width: {wide}px" role="img" '
        f'aria-label="{said}">{bars}</svg>'
    )


def _bar(place: int, share: float, count: int, full: float) -> str:
    """A bar with the number of submissions above it and the least points below it."""
    high, middle = round(HEIGHT * share), BAR * place + BAR // 2
    top = LABELS + HEIGHT - high
    return (
        f'<rect x="{BAR * place + 2}" y="{top}" width="{BAR - 4}" height="{high}"/>'
        f'<text x="{middle}" y="{top - 4}">{count}</text>'
        f'<text x="{middle}" y="{HEIGHT + 2 * LABELS - 4}">{number(full * place / BINS)}+</text>'
    )


def _causes(whole: ClassGrade, grades: Mapping[str, Grade], page: str) -> Iterator[str]:
    """For each test, why points were lost and by whom, the most frequent cause first."""
    yield "<h2>Lost points by cause</h2>"
    yield "<table><tr><th>Test</th><th>Cause</th><th class=points>Submissions</th><th>Whose</th></tr>"
    tests = {test.id: test.name for grade in grades.values() for test in grade.tests}
    found = _owners(whole, grades)
    for (test, cause), entries in sorted(found.items(), key=lambda item: (-len(item[1]), item[0])):
        yield (
            f"<tr><td>{words(line(tests[test]))}</td><td>{words(cause)}</td>"
            f"<td class=points>{len(entries)}</td><td>{_links(entries, page)}</td></tr>"
        )
    yield "</table>"


def _owners(whole: ClassGrade, grades: Mapping[str, Grade]) -> dict[tuple[str, str], list[ClassEntry]]:
    found = defaultdict[tuple[str, str], list[ClassEntry]](list)
    for entry in whole.students:
        for test in grades[entry.student].tests:
            if test.status != "passed":
                found[test.id, cause_of(test)].append(entry)
    return found


def cause_of(test: TestGrade) -> str:
    """Why a test lost points, in a few words."""
    if test.status in OPEN or test.status == "skipped":
        return WORDS[test.status]
    return test.diagnosis[0].cause if test.diagnosis else UNEXPLAINED


def _shared(whole: ClassGrade, page: str) -> Iterator[str]:
    entries = {entry.student: entry for entry in whole.students}
    yield "<h2>The same files</h2>"
    if not whole.shared_files:
        yield "<p>No two submissions have a file in common.</p>"
        return
    yield "<p>These files agree byte for byte. That is a reason to ask, not a proof.</p>"
    yield "<table><tr><th>Submissions</th><th>Tests</th></tr>"
    for shared in whole.shared_files:
        owners = _links([entries[name] for name in shared.students], page)
        yield f"<tr><td>{owners}</td><td>{words(', '.join(shared.tests))}</td></tr>"
    yield "</table>"


def _students(whole: ClassGrade, page: str) -> Iterator[str]:
    yield "<h2>Submissions</h2>"
    yield "<table><tr><th>Submission</th><th class=points>Points</th><th>Not graded</th><th>Signals</th></tr>"
    for entry in whole.students:
        signals = ", ".join(f"{signal.test}: {signal.code}" for signal in entry.signals)
        points = number(entry.score) if entry.gradable else "–"
        yield (
            f"<tr><td>{_links([entry], page)}</td><td class=points>{points}</td>"
            f"<td>{words(', '.join(entry.ungraded))}</td><td>{words(signals)}</td></tr>"
        )
    yield "</table>"


def _links(entries: Sequence[ClassEntry], page: str) -> str:
    return ", ".join(
        f'<a href="{words(entry.folder)}/{page}">{words(line(entry.student) or "(no name)")}</a>'
        for entry in entries
    )
