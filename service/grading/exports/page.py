"""A page that explains a result: one HTML file without scripts or external resources."""

from __future__ import annotations

import html
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from accuracy.comparison.heat import GAP_PIXELS
from schemas.grading.grades import Grade, GradeInput
from service.grading.exports.pictures import Album, Shown, album
from service.grading.exports.rows import Row, for_staff, for_students, headline
from service.grading.exports.texts import harmless, line

OUTLINED = 3
"""Number of worst regions outlined in the pictures; the text lists all of them."""

# Content Security Policy: browsers run no scripts and load no resources, whatever the page contains.
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"

STYLE = """
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; padding: .3rem .6rem; border-bottom: 1px solid #8886; vertical-align: top; }
.points { text-align: right; white-space: nowrap; }
section { margin-top: 2rem; border-top: 1px solid #8886; }
.words { white-space: pre-line; overflow-wrap: anywhere; }
svg { width: 100%; height: auto; image-rendering: pixelated; }
rect { fill: none; stroke: #0af; stroke-width: 2; vector-effect: non-scaling-stroke; }
.staff { border: 2px solid #c60; padding: 0 1rem; }
"""


def for_reading(grade: Grade, pictures: Path | None = None) -> bytes:
    """Export the page for students: hidden tests share one line, and signals are left out."""
    rows = for_students(grade)
    return _page(grade, rows, album(rows, pictures), ())


def for_staff_review(grade: Grade, pictures: Path | None = None) -> bytes:
    """Export the page for staff: every test, the signals, and the files that were read."""
    rows = for_staff(grade)
    return _page(grade, rows, album(rows, pictures), _staff(grade))


def _page(grade: Grade, rows: Sequence[Row], shown: Album, staff: Iterator[str] | tuple[()]) -> bytes:
    scenes = "of this student alone" if grade.own_scenes else None
    whose = "".join(
        f"<p>{label}: {words(line(value))}</p>"
        for label, value in (("Student", grade.student), ("Submitted", grade.submitted), ("Scenes", scenes))
        if value is not None
    )
    parts = [
        f"{whose}<p><strong>{words(headline(grade))}</strong></p>",
        "<table><tr><th>Test</th><th class=points>Points</th><th>Result</th></tr>",
        *(_entry(row) for row in rows),
        "</table>",
        *staff,
        *(_section(row, shown.of(row), grade.inputs) for row in rows),
    ]
    tool = f"<footer><p>{words(f'{grade.tool.name} {grade.tool.version}')}</p></footer>"
    return document(grade.title, parts, after=tool)


def document(title: str, parts: Iterable[str], *, style: str = "", after: str = "") -> bytes:
    """A whole page: a heading and what follows it, with more style than all pages have, and a footer."""
    name, content = words(line(title)), "\n".join(parts)
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{name}</title>\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        f'<meta name="viewport" content="width=device-width">\n<style>{STYLE}{style}</style>\n</head>\n'
        f"<body>\n<main>\n<h1>{name}</h1>{content}\n</main>\n{after}\n</body>\n</html>\n"
    ).encode()


def words(text: str) -> str:
    """Untrusted text as HTML."""
    return html.escape(harmless(text))


def _entry(row: Row) -> str:
    return f"<tr><td>{_name(row)}</td><td class=points>{row.total}</td><td>{row.result}</td></tr>"


def _name(row: Row) -> str:
    return words(row.name) + (" (hidden)" if row.test is not None and row.test.hidden else "")


def _section(row: Row, pictures: Sequence[Shown], inputs: Sequence[GradeInput]) -> str:
    width = next((read.width for read in inputs if read.test == row.id and read.width), None)
    places = "".join(f"<li>{words(place)}</li>" for place in row.places)
    figures = (
        f"<figure>{_drawn(picture, row, width)}<figcaption>{words(picture.label)}</figcaption></figure>"
        for picture in pictures
    )
    return (
        f"<section><h2>{_name(row)}: {row.total}</h2>\n"
        f'<p class="words">{words(row.message)}</p>\n'
        + (f"<p>Where the pictures differ most:</p><ul>{places}</ul>\n" if places else "")
        + "\n".join(figures)
        + "</section>"
    )


def _drawn(picture: Shown, row: Row, width: int | None) -> str:
    """A picture; the worst regions are outlined if it shows whole pictures of the submission's width."""
    wide, high = picture.size
    regions = row.test.worst_regions[:OUTLINED] if row.test is not None and row.status != "passed" else ()
    outlines = "".join(
        f'<rect x="{left + region.x0}" y="{region.y0}" width="{region.x1 - region.x0}" '
        f'height="{region.y1 - region.y0}"/>'
        for left in _lefts(wide, width)
        for region in regions
    )
    return (
        f'<svg viewBox="0 0 {wide} {high}" width="{wide}" height="{high}" role="img" '
        f'aria-label="{_name(row)}: {words(picture.label)}">'
        f'<image href="{picture.url}" width="{wide}" height="{high}"/>'
        f"{outlines}</svg>"
    )


def _lefts(wide: int, width: int | None) -> list[int]:
    """Left edges of the pictures of a width: of one, or of three side by side."""
    if width is None:
        return []
    return {width: [0], 3 * width + 2 * GAP_PIXELS: [place * (width + GAP_PIXELS) for place in range(3)]}.get(
        wide, []
    )


def _staff(grade: Grade) -> Iterator[str]:
    yield '<section class="staff"><h2>For staff</h2>'
    if not grade.signals:
        yield "<p>No signals.</p>"
    for signal in grade.signals:
        yield f"<p><strong>{words(signal.test)}: {words(signal.code)}</strong> {words(signal.message)}</p>"
    yield "<table><tr><th>Test</th><th>File</th><th>SHA-256</th></tr>"
    for read in grade.inputs:
        yield (
            f"<tr><td>{words(read.test)}</td><td>{words(line(read.name))} ({read.role})</td>"
            f"<td><code>{words(read.sha256 or '')[:16]}</code></td></tr>"
        )
    yield "</table></section>"
