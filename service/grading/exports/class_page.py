"""A page that sums up a class: points, causes and links, one HTML file without scripts or other resources."""

from __future__ import annotations

import statistics
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import chain

from schemas.grading.classes import ClassEntry, ClassGrade, SharedFiles, SharedNoise
from schemas.grading.grades import Grade, TestGrade
from service.grading.exports.page import document, words
from service.grading.exports.rows import OPEN, WORDS
from service.grading.exports.texts import line, number, shortened

TENTHS, MOST_BARS = 10, 20
"""Bars of the histogram up to the full score, and with those of bonus points; the last one has all above."""

MOST_NAMES = 12
"""Longer lists of submissions are folded."""

UNEXPLAINED = "no cause found"

LONGEST_NAME = 40
"""Characters of a submission's name in lists; all of it shows beside the pointer."""

MORE_STYLE = """
a { overflow-wrap: anywhere; }
@media (max-width: 40rem) {
  .lists tr { display: block; border-bottom: 1px solid #8886; }
  .lists th { display: none; }
  .lists td { display: block; border: none; text-align: left; padding: .1rem 0; }
  .lists td:first-child { font-weight: bold; }
}
.bars { width: 100%; max-width: 40rem; }
.bars td { padding: 0 .6rem; vertical-align: middle; }
.bars td:last-child { width: 100%; }
.bars div { background: #28c; height: 1rem; }
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
    links = {entry.student: _link(entry, page) for entry in whole.students}
    parts = _summary(whole), _causes(grades, links), _signals(whole, links), _students(whole, links)
    return document(whole.title, chain.from_iterable(parts), style=MORE_STYLE)


def histogram(scores: Sequence[float], full: float) -> list[int]:
    """Numbers of scores in each tenth of the full score, and in those above it that are reached.

    >>> histogram([0, 9.99, 10, 55, 100, 125], 100)
    [2, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1]
    """
    places = [min(int(TENTHS * score / full), MOST_BARS - 1) for score in scores]
    counts = [0] * max(TENTHS, *(place + 1 for place in places))
    for place in places:
        counts[place] += 1
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
        yield from _bars(histogram(complete, whole.max_score), whole.max_score)


def _bars(counts: Sequence[int], full: float) -> Iterator[str]:
    """The histogram as a table: the least points of a bar, and the number of submissions."""
    yield "<table class=bars><tr><th class=points>Points</th><th class=points>Submissions</th><td></td></tr>"
    for place, count in enumerate(counts):
        yield (
            f"<tr><td class=points>{number(full * place / TENTHS)}+</td><td class=points>{count}</td>"
            f'<td aria-hidden="true"><div style="width: {100 * count / max(counts):.0f}%"></div></td></tr>'
        )
    yield "</table>"


def _causes(grades: Mapping[str, Grade], links: Mapping[str, str]) -> Iterator[str]:
    """For each cause, in which tests it cost points, and whom; the most frequent one first."""
    yield "<h2>Lost points by cause</h2>"
    yield (
        "<table class=lists><tr><th>Cause</th><th class=points>Submissions</th><th>Tests</th>"
        "<th>Whose</th></tr>"
    )
    lost = defaultdict[str, dict[str, list[str]]](dict)
    for student, grade in grades.items():
        for test in grade.tests:
            if test.status != "passed":
                lost[cause_of(test)].setdefault(student, []).append(test.id)
    for cause, students in sorted(lost.items(), key=lambda item: (-len(item[1]), item[0])):
        tests = Counter(chain.from_iterable(students.values())).most_common()
        named = ", ".join(f"{name} ({count})" for name, count in tests)
        yield (
            f"<tr><td>{words(cause)}</td><td class=points>{len(students)}</td><td>{words(named)}</td>"
            f"<td>{_links(students, links)}</td></tr>"
        )
    yield "</table>"


def cause_of(test: TestGrade) -> str:
    """Why a test lost points, in a few words."""
    if test.status in OPEN or test.status == "skipped":
        return WORDS[test.status]
    return test.diagnosis[0].cause if test.diagnosis else UNEXPLAINED


def _signals(whole: ClassGrade, links: Mapping[str, str]) -> Iterator[str]:
    """Similarities of submissions to each other, or to the reference."""
    yield "<h2>Signals</h2>"
    alone = [entry for entry in whole.students if entry.signals]
    if not (alone or whole.shared_files or whole.shared_noise):
        yield "<p>None.</p>"
    else:
        yield from _found(whole, alone, links)
    for left in whole.not_compared:
        names = _links(left.students, links)
        yield f"<p>Pictures of {words(left.test)} not compared: {words(left.reason)} {names}</p>"


def _found(whole: ClassGrade, alone: Sequence[ClassEntry], links: Mapping[str, str]) -> Iterator[str]:
    yield (
        "<p>A signal is a reason to ask, not a proof. Pictures have the same noise if one was made from the "
        "other, or if both programs draw the same random numbers.</p>"
    )
    yield "<table class=lists><tr><th>Signal</th><th>Submissions</th><th>Tests</th></tr>"
    yield from _shared("the same file", whole.shared_files, links)
    yield from _shared("the same noise", whole.shared_noise, links)
    for entry in alone:
        for signal in entry.signals:
            yield _signal(signal.message, links[entry.student], [signal.test])
    yield "</table>"


def _shared(
    what: str, groups: Sequence[SharedFiles | SharedNoise], links: Mapping[str, str]
) -> Iterator[str]:
    for shared in groups:
        yield _signal(what, _links(shared.students, links), shared.tests)


def _signal(what: str, links: str, tests: Sequence[str]) -> str:
    return f"<tr><td>{words(what)}</td><td>{links}</td><td>{words(', '.join(tests))}</td></tr>"


def _students(whole: ClassGrade, links: Mapping[str, str]) -> Iterator[str]:
    yield "<h2>Submissions</h2>"
    yield "<table class=lists><tr><th>Submission</th><th class=points>Points</th><th>Not graded</th>"
    yield "<th>Adjusted</th></tr>"
    for entry in whole.students:
        points = number(entry.score) if entry.gradable else "–"
        yield (
            f"<tr><td>{links[entry.student]}</td><td class=points>{points}</td>"
            f"<td>{words(', '.join(entry.ungraded))}</td><td>{words(_adjusted(entry))}</td></tr>"
        )
    yield "</table>"
    if whole.left_out:
        names = words(line(", ".join(whole.left_out)))
        yield f"<p>Not graded, because they are no folders: {names}.</p>"


def _adjusted(entry: ClassEntry) -> str:
    """Adjustments by staff and lateness."""
    late = f"late: -{number(entry.late.points)}" if entry.late is not None else ""
    by_staff = f"set by staff: {', '.join(entry.overridden)}" if entry.overridden else ""
    return "; ".join(filter(None, (late, by_staff)))


def _links(students: Collection[str], links: Mapping[str, str]) -> str:
    listed = ", ".join(links[student] for student in students)
    if len(students) <= MOST_NAMES:
        return listed
    return f"<details><summary>{len(students)} submissions</summary>{listed}</details>"


def _link(entry: ClassEntry, page: str) -> str:
    name = line(entry.student) or "(no name)"
    short = shortened(name, LONGEST_NAME)
    title = f' title="{words(name)}"' if short != name else ""
    return f'<a href="{words(entry.folder)}/{page}"{title}>{words(short)}</a>'
