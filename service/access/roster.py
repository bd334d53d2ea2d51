"""Rosters: class lists as CSV, from which each user gets one key."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

from pydantic import ValidationError
from sqlalchemy import insert
from sqlalchemy.orm import Session

from schemas.api.administration import KeyRequest
from schemas.errors import Problem, SceneError
from schemas.reading.translation import nearest, translate
from service.access import keys
from service.storage.database.models import KeyRow

COLUMNS = tuple(KeyRequest.model_fields)
NUMBERS: dict[str, type[float]] = {"max_jobs": int, "max_cpu_seconds": float}
MAX_BYTES = 1 << 20
MAX_USERS = 5_000
"""Users of one roster, whose keys are written in one transaction of half a second."""


class Enrolment(NamedTuple):
    """A line of the table that answers a roster; ``key`` is empty if the user had a valid one before."""

    user: str
    role: str
    id: str
    expires_at: str
    key: str


def read(content: bytes) -> list[KeyRequest]:
    """Read a roster: its first line names the columns, of which `user` is needed.

    Raises
    ------
    SceneError
        With every problem and its line.
    """
    (_, header), *lines = _lines(content)
    problems = list(_unknown_columns(header))
    if len(lines) > MAX_USERS:
        problems.append(_problem(1, f"A roster has {MAX_USERS:,} users at most. Split it.", "too_many"))
    found: dict[str, KeyRequest] = {}
    for number, cells in lines if not problems else ():
        try:
            row = _row(header, cells)
        except ValidationError as error:
            findings, _ = translate(error, KeyRequest, {})
            problems += [_problem(number, f"{one.location[0]}: {one.detail}", one.code) for one in findings]
            continue
        if row.user in found:
            problems.append(_problem(number, f"The user {row.user!r} is listed twice.", "repeated_user"))
        found[row.user] = row
    if problems:
        raise SceneError(problems)
    return list(found.values())


def _lines(content: bytes) -> list[tuple[int, list[str]]]:
    """Return the lines that are not empty, with their numbers; there is at least one."""
    try:
        reader = csv.reader(io.StringIO(content.decode("utf-8-sig"), newline=""), strict=True)
        lines = [(reader.line_num, [cell.strip() for cell in cells]) for cells in reader if any(cells)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise SceneError([_problem(1, f"This is not CSV in UTF-8: {error}.", "not_csv")]) from None
    return lines or [(1, [])]


def _unknown_columns(header: Sequence[str]) -> Iterator[Problem]:
    known = f"The columns are {', '.join(COLUMNS)}."
    if "user" not in header:
        yield _problem(
            1, f"The first line must name the columns, and one of them 'user'. {known}", "no_header"
        )
    for name in header:
        if name not in COLUMNS or header.count(name) > 1:
            problem = _problem(
                1, f"There is no column {name!r}, or it is there twice. {known}", "unknown_field"
            )
            yield problem.model_copy(update={"suggestion": nearest(name, COLUMNS)})


def _row(header: Sequence[str], cells: Sequence[str]) -> KeyRequest:
    """Read a line; cells that are empty or missing have their defaults, surplus cells are refused by name."""
    names = [*header, *(f"column {number}" for number in range(len(header) + 1, len(cells) + 1))]
    given = {name: _value(name, cell) for name, cell in zip(names, cells, strict=False) if cell}
    return KeyRequest.model_validate({"user": ""} | given)


def _value(column: str, cell: str) -> str | float:
    """Return a number where the column has numbers; text there is refused later, with the other problems."""
    with suppress(KeyError, ValueError):
        return NUMBERS[column](cell)
    return cell


def _problem(line: int, detail: str, code: str) -> Problem:
    return Problem(pointer="", detail=detail, code=code, line=line, column=1)


def enrol(session: Session, roster: Sequence[KeyRequest]) -> list[Enrolment]:
    """Create a key for each user who has no valid one. Keys that are there stay as they are."""
    found = {row["user"]: _enrolment(dict(row)) for row in keys.valid(session)}
    made = [keys.new_key(**dict(asked)) for asked in roster if asked.user not in found]
    if made:
        # In one statement and without objects: others wait for the transaction.
        session.execute(insert(KeyRow), [values for _, values in made])
    found |= {values["user"]: _enrolment(values, str(key)) for key, values in made}
    return [found[asked.user] for asked in roster]


def _enrolment(row: Mapping[str, Any], key: str = "") -> Enrolment:
    end = row.get("expires_at")
    expires_at = end.isoformat(timespec="minutes") if end else ""
    return Enrolment(row["user"], row["role"], row["id"], expires_at, key)


def write(enrolments: Iterable[Enrolment]) -> str:
    """Write the answer to a roster as CSV."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(Enrolment._fields)
    writer.writerows(enrolments)
    return text.getvalue()
