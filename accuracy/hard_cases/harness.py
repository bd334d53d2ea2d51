"""What a hard case is, how the renderer and textbooks are asked, and how wrong answers are counted.

A case asks the renderer, and a textbook's formula in float64 and in float32, the same question. Right is what
exact numbers or closed forms say; an `exact` answer always has 50 digits.
"""

import io
import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import mpmath
import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray
from PIL import Image

import renderer
from accuracy.hard_cases.documents import Json, scene
from renderer.integrator import intersect, local_radiance
from renderer.interaction import Points, Rays
from renderer.math.arrays import Floats
from renderer.math.numerics import EPS
from schemas.errors import Problem, SceneError
from schemas.quality import FixedQuality
from schemas.reading import read_scene

__all__ = ["EPS", "Case", "Cases", "Outcome", "Section"]

SINGLE = FixedQuality(mode="fixed", precision="single")
DOUBLE = FixedQuality(mode="fixed", precision="double")
QUALITIES = (SINGLE, DOUBLE)

DTYPES: tuple[type[np.floating], ...] = (np.float64, np.float32)
"""Those in which a textbook's formula is asked."""

DIGITS = 50
"""Of exact answers that no rational number is: 34 more than a double has."""

P = ParamSpec("P")
Answer = TypeVar("Answer")


def exact(oracle: Callable[P, Answer]) -> Callable[P, Answer]:
    """Compute an exact answer to `DIGITS` digits, whatever mpmath works with around it."""

    @wraps(oracle)
    def answer(*args: P.args, **kwargs: P.kwargs) -> Answer:
        with mpmath.workdps(DIGITS):
            return oracle(*args, **kwargs)

    return answer


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of trying a case.

    Attributes
    ----------
    tried : int
        Answers checked: rays, points, pixels or inputs.
    wrong : int
        Wrong answers of the renderer.
    textbook, textbook_single : int or None
        Wrong answers of the textbook's formula to the same questions, in float64 and in float32. None where
        it was not asked: it has no formula for them, or none that could be right.
    worst : float or None
        Largest error among the right answers, in shares of what the case allows: at most 1.
    """

    tried: int
    wrong: int
    textbook: int | None = None
    textbook_single: int | None = None
    worst: float | None = None


def judged(errors: Floats, *textbook: ArrayLike) -> Outcome:
    """Count errors above 1, and NaN, as wrong: the renderer's (N,), and a textbook's in each dtype asked."""
    right = errors[errors <= 1]
    plain = [tally(~(np.asarray(each) <= 1)) for each in textbook]
    outcome = Outcome(errors.size, errors.size - right.size, *plain)
    return replace(outcome, worst=float(right.max(initial=0.0)))


Outcomes = Outcome | Iterable["Outcomes"]
"""One outcome, or those of the parts of a case, however they are nested."""


def total(outcomes: Outcomes) -> Outcome:
    """Several outcomes of one case as one."""
    parts = list(each_of(outcomes))
    return Outcome(
        tried=sum(part.tried for part in parts),
        wrong=sum(part.wrong for part in parts),
        textbook=_sum(part.textbook for part in parts),
        textbook_single=_sum(part.textbook_single for part in parts),
        worst=max((part.worst for part in parts if part.worst is not None), default=None),
    )


def each_of(outcomes: Outcomes) -> Iterator[Outcome]:
    """The outcomes of all parts, each as soon as it is there."""
    if isinstance(outcomes, Outcome):
        yield outcomes
    else:
        for part in outcomes:
            yield from each_of(part)


def _sum(counts: Iterable[int | None]) -> int | None:
    known = [count for count in counts if count is not None]
    return sum(known) if known else None


def plain_only(*textbook: int | None) -> Outcome:
    """What a textbook gets wrong of questions that other outcomes of the case count."""
    return Outcome(0, 0, *textbook)


Cases = Mapping[str, Callable[[], Outcomes]]
"""What tries each case, by its heading, such as "A1, A2: name"; numerics_cases.toml describes them."""


@dataclass(frozen=True, slots=True)
class Case:
    """One hard case.

    Attributes
    ----------
    ids : tuple of str
        Its numbers in the catalogue: the letter of its section and a number.
    name : str
        In words.
    outcomes : callable
        Tries the case, part by part.
    """

    ids: tuple[str, ...]
    name: str
    outcomes: Callable[[], Outcomes]

    def run(self) -> Outcome:
        """Try the whole case."""
        return total(self.outcomes())

    @property
    def heading(self) -> str:
        """Its numbers and its name."""
        return f"{', '.join(self.ids)}: {self.name}"


@dataclass(frozen=True, slots=True)
class Section:
    """Cases that belong together, under a title."""

    title: str
    cases: tuple[Case, ...]


def section(title: str, *parts: Cases) -> Section:
    """All cases of some tables, in their order."""
    return Section(title, tuple(itertools.starmap(_case, itertools.chain(*(part.items() for part in parts)))))


def _case(heading: str, outcomes: Callable[[], Outcomes]) -> Case:
    ids, name = heading.split(": ", 1)
    return Case(tuple(ids.split(", ")), name, outcomes)


def problems_of(source: Json | bytes) -> list[Problem]:
    """What a scene is refused for; nothing if it is read."""
    try:
        read_scene(source)
    except SceneError as refused:
        return list(refused.errors)
    return []


def refused_at(source: Json | bytes, place: str, *, within: bool = False) -> bool:
    """Whether a scene is refused, and every problem is reported at a place, or at one within it."""
    pointers = [problem.pointer for problem in problems_of(source)]
    if within:
        pointers = [pointer[: len(place)] for pointer in pointers]
    return set(pointers) == {place}


def tally(mask: ArrayLike) -> int:
    """How many are true."""
    return int(np.count_nonzero(mask))


def eps_of(dtype: DTypeLike) -> float:
    """Spacing of numbers of a type, or of a precision by name, at 1."""
    return float(np.finfo(dtype).eps)


def in_both(formula: Callable[[Any], Answer]) -> list[Answer]:
    """What a textbook's formula says in float64 and in float32; it may overflow and divide by 0."""
    with np.errstate(all="ignore"):
        return [formula(dtype) for dtype in DTYPES]


class Files(dict[str, bytes]):
    """Files that exist in memory only."""

    def read(self, name: str) -> bytes:
        """The content of a file."""
        return self[name]


def png(codes: NDArray[Any]) -> bytes:
    """A picture file of codes (H, W, 3) uint8, or of heights (H, W) uint16."""
    buffer = io.BytesIO()
    Image.fromarray(codes).save(buffer, format="PNG")
    return buffer.getvalue()


def compiled(
    document: Json, quality: FixedQuality | None = None, files: dict[str, bytes] | None = None
) -> renderer.RenderPlan:
    """The plan of a scene with files in memory."""
    return renderer.compile_scene(renderer.load_scene(document, assets=Files(files or {})), quality)


def traced(shapes: Sequence[Json], origins: ArrayLike, directions: ArrayLike) -> renderer.Hits:
    """What rays (N, 3) hit of shapes without lights."""
    return renderer.trace(compiled(scene(*shapes)), origins, directions)


def radiance(plan: renderer.RenderPlan, origins: Floats, directions: Floats) -> Floats:
    """Radiance (3, N) along rays (3, N), without what comes by further rays."""
    return local_radiance(plan, rays_of(origins, directions), Counter())[0]


def points(plan: renderer.RenderPlan, origins: Floats, directions: Floats) -> Points:
    """The points that rays (3, N) hit, ready for light."""
    rays = rays_of(origins, directions)
    return intersect(plan, rays, lights=False)


def rays_of(origins: Floats, directions: Floats) -> Rays:
    """Rays (3, N), each of a pixel of its own."""
    numbers = np.arange(directions.shape[1])
    return Rays(origins, directions, numbers, np.zeros_like(numbers))
