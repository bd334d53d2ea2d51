"""What is sent: values, arrays and models of Python become JSON, or are refused in their place."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy.typing as npt

from schemas.findings import Finding, refusal
from schemas.limits import limits_in_force
from schemas.plain import plain
from schemas.pointers import Parts
from schemas.sentences import say


def sendable(members: Mapping[str, Any]) -> dict[str, Any]:
    """Members of a request as JSON has them; NumPy and models may be among them.

    Raises
    ------
    schemas.errors.SceneError
        With every value that JSON has no word for.
    """
    made = {name: plain(value, max_depth=limits_in_force().max_depth) for name, value in members.items()}
    refuse_not_finite(made, None)
    return made


def rows(origins: npt.ArrayLike, directions: npt.ArrayLike) -> dict[str, Any]:
    """Origins and directions of rays (rays, 3) as lists of numbers, as a request has them.

    Raises
    ------
    ValueError
        One has another shape, or does not hold real numbers.
    """
    # Not before somebody casts rays: a client needs nothing of the renderer otherwise.
    from renderer.math.arrays import vectors  # noqa: PLC0415

    given = {"origins": origins, "directions": directions}
    return {name: vectors(name, values).tolist() for name, values in given.items()}


def refuse_not_finite(content: object, text: str | None) -> None:
    """Refuse NaN and infinity, which JSON cannot carry.

    Parameters
    ----------
    text
        What the content was read from, so that places have lines; None where it never was text.

    Raises
    ------
    schemas.errors.SceneError
        With the place of each of them.
    """
    findings = [Finding(parts, *say("finite_number", "", {})) for parts in _not_finite(content, ())]
    if findings:
        raise refusal(findings, content, text)


def _not_finite(node: object, parts: Parts) -> Iterator[Parts]:
    if isinstance(node, float):
        if not math.isfinite(node):
            yield parts
    elif isinstance(node, Mapping):
        for name, member in node.items():
            yield from _not_finite(member, (*parts, name))
    elif isinstance(node, list):
        for number, entry in enumerate(node):
            # Most entries are numbers that need no place.
            if type(entry) is not float or not math.isfinite(entry):
                yield from _not_finite(entry, (*parts, number))
