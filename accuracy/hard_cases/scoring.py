"""Counts wrong answers about rays and one shape, against exact arithmetic.

A hit for a miss, or the other way round, is excused within 16 roundings of the border, as the numbers that
came in were rounded too. Any other is wrong, and so is a hit whose t is off by more than a case allows.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

import renderer
from accuracy.hard_cases import oracle
from accuracy.hard_cases.answers import Answer
from accuracy.hard_cases.cases import Outcome, total
from accuracy.hard_cases.documents import scene
from accuracy.hard_cases.draws import Case as FamilyCase
from renderer.math.arrays import Floats
from schemas.reading import read_scene

EXCUSED = 16
"""Roundings of the border within which hit and miss are a matter of opinion."""

Textbook = Callable[[Any, Any, Any], Any]
"""A shape, origins (N, 3) and directions (N, 3) of one dtype, to t (N,): inf or NaN where nothing is hit."""

Allowed = Callable[[Any, Answer, Floats, Floats], float]
"""A shape, the exact answer, and the ray, to the error of t that is right, in units of t."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What counts as right for one precision.

    Attributes
    ----------
    dtype : float32 or float64
    allowed : callable
    """

    dtype: type[np.floating]
    allowed: Allowed

    @property
    def margin(self) -> float:
        """Distance from the border, in shares of the largest coordinate, within which errors are excused."""
        return EXCUSED * float(np.finfo(self.dtype).eps)


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What the renderer says of one ray (3,) that hits."""

    origin: Floats
    direction: Floats
    position: Floats
    normal: Floats
    uv: Floats


Details = Callable[[Any, Answer, Found], float]
"""A shape, the exact answer and the renderer's, to the error of the rest, in shares of what is right."""


def relative(share: float) -> Allowed:
    """Allow an error of t of a share of itself."""

    def allowed(shape: Any, true: Answer, origin: Floats, direction: Floats) -> float:
        del shape, origin, direction
        return share * true.t

    return allowed


DOUBLE = Tolerance(np.float64, relative(1e-10))
SINGLE = Tolerance(np.float32, relative(1e-4))


def tried(
    family: Iterable[FamilyCase],
    textbook: Textbook,
    *,
    double: Tolerance = DOUBLE,
    single: Tolerance = SINGLE,
    details: Details | None = None,
) -> Outcome:
    """Ask `renderer.trace`, and the textbook formula in both precisions, about a family of rays.

    `details` judges what the renderer says beside t.
    """
    return total(_asked(document, rays, textbook, double, single, details) for document, rays in family)


def _asked(
    document: dict[str, Any],
    rays: Any,
    textbook: Textbook,
    double: Tolerance,
    single: Tolerance,
    details: Details | None,
) -> Outcome:
    written = scene(document)
    shape = read_scene(written)[0].shapes[0]
    origins, directions = (np.array(part, dtype=np.float64) for part in zip(*rays, strict=True))
    true = [oracle.answer(shape, *ray) for ray in rays]
    hits = renderer.trace(renderer.compile_scene(renderer.load_scene(written)), origins, directions)
    errors = _errors(double, shape, true, origins, directions, hits.t)
    if details is not None:
        errors = np.maximum(errors, _rest(details, shape, true, hits, origins, directions))
    plain = {
        tolerance.dtype: _plain_errors(textbook, tolerance, shape, true, origins, directions)
        for tolerance in (double, single)
    }
    right = errors[errors <= 1]
    return Outcome(
        tried=len(true),
        wrong=int(np.count_nonzero(errors > 1)),
        textbook=int(np.count_nonzero(plain[np.float64] > 1)),
        textbook_single=int(np.count_nonzero(plain[np.float32] > 1)),
        worst=float(right.max(initial=0.0)),
    )


def _rest(
    details: Details,
    shape: Any,
    true: list[Answer],
    hits: renderer.Hits,
    origins: Floats,
    directions: Floats,
) -> Floats:
    """Errors (N,) of what comes with right hits, in shares of what is right."""
    errors = np.zeros(len(true))
    for i, answer in enumerate(true):
        if answer.hit and math.isfinite(hits.t[i]):
            row = (origins[i], directions[i], hits.position[i], hits.normal[i], hits.uv[i])
            errors[i] = details(shape, answer, Found(*row))
    return errors


def _plain_errors(
    textbook: Textbook,
    tolerance: Tolerance,
    shape: Any,
    true: list[Answer],
    origins: Floats,
    directions: Floats,
) -> Floats:
    with np.errstate(all="ignore"):
        t = textbook(shape, origins.astype(tolerance.dtype), directions.astype(tolerance.dtype))
    return _errors(tolerance, shape, true, origins, directions, np.asarray(t, dtype=np.float64))


def _errors(
    tolerance: Tolerance,
    shape: Any,
    true: list[Answer],
    origins: Floats,
    directions: Floats,
    found: Floats,
) -> Floats:
    """Error of each answer (N,), in shares of what is right: inf for a hit that is none or a lost one."""
    errors = np.zeros(len(true))
    for i, answer in enumerate(true):
        hit = math.isfinite(found[i])
        if answer.hit != hit:
            errors[i] = 0.0 if answer.margin <= tolerance.margin else math.inf
        elif hit:
            allowed = tolerance.allowed(shape, answer, origins[i], directions[i])
            errors[i] = abs(found[i] - answer.t) / allowed
        if math.isnan(found[i]) and tolerance.dtype is np.float64:
            errors[i] = math.inf
    return errors
