"""Mistakes that a program makes in all its pictures, found in all of them together.

One picture may look as if it was shifted, too dark or encoded wrongly because it shows something else. A
program that shifts, darkens or encodes wrongly does so in every picture. So all pictures are predicted for
products of mistakes, and the prediction that is closest to all of them is taken apart: a mistake is reported
if without it the pictures are significantly farther away, in most of the pictures where it would show, and if
the pictures then agree with their references.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import compress, product

import numpy as np

from accuracy.comparison import Picture, Policy
from accuracy.comparison.blocks import Bias, bias, gathered
from accuracy.comparison.diagnosis import JAGGED, JAGGED_HINT, diagnose, has_soft_edges, jagged_left_over
from accuracy.comparison.mistakes import (
    CHANNELS,
    ENCODINGS,
    EXPOSURE,
    LEAST_EXPOSURE,
    Mistake,
    exposure_hint,
)
from accuracy.comparison.ratings import FLOOR, MAX_RMSE_LEFT, MIN_GAIN_ERRORS, Rating
from renderer.errors import MissingExtraError
from renderer.math.arrays import Floats
from schemas.grading.acceptance import Verdict
from schemas.grading.manifests import ImageTest
from service.grading.displacements import DISPLACEMENTS
from service.grading.errors import GradingError
from service.grading.mistakes.hints import AMBIENT_HINT
from service.grading.programs.program import (
    MISTAKES,
    NONE,
    Pair,
    Program,
    ProgramMistake,
    ProgramMistakes,
    encoded,
    is_undone,
    orientations,
)
from service.grading.references import read_picture, reference_picture, reference_scene
from service.grading.repairing import ambient_term
from service.grading.settings import Run

GLANCE = 16_000
"""Most pixels of a picture that the search for the closest program looks at: with all of ten pictures of
512 x 384 it takes 9 CPU seconds."""

CLEAR = 3.0
"""Standard errors by which a single picture speaks for or against a mistake."""

OUTWEIGHED = 2
"""So many pictures must speak for a mistake for each that speaks against it."""

LEAST_PICTURES = 2
"""So many must speak for it at least: what is in a single picture may be a mistake of that picture."""

MOST_BIAS = 0.02
"""Share of biased blocks up to which nothing is looked for: the usual limit of the verdict."""

AGREED = 0.05
"""Share of biased blocks of a picture that agrees: predictions are less exact than references."""

STEPS = 5
"""Steps that find an exposure; brightness is so close to a power of it that two are enough for most."""

LEAST_POWER = 0.1
"""Of the exposure, in the brightness of a picture: pictures that are white nearly everywhere have less."""

CORNER_HINT = (
    "Edges are jagged: each pixel shows the colour at its corner, where the reference shows its mean. Take "
    "the mean of several camera samples over the pixel's square, from its corner to the next."
)

LEAST_SIDE = 3
"""Pixels along the shorter side of a picture in which a shift can be seen."""


def search(run: Run) -> ProgramMistakes:
    """The mistakes of a program that the manifest charges once.

    Pictures that are missing or cannot be compared are left out.
    """
    kinds = {kind for charge in run.manifest.charged_once for kind in charge.mistakes}
    # Pictures that agree need not be in memory together.
    if all(agree(*pictures, _tolerance(test)) for test, pictures in _pictures(run)):
        return NONE
    seen = {test.id: _pair(test, *pictures) for test, pictures in _pictures(run)}
    if "ambient" in kinds:
        tests = {test.id: test for test in run.manifest.tests if isinstance(test, ImageTest)}
        seen = {name: _with_ambient(tests[name], pair, run) for name, pair in seen.items()}
    made = shared(seen, kinds)
    return replace(made, found=tuple(_charged(each, made.program, [*seen], run) for each in made.found))


def _pictures(run: Run) -> Iterator[tuple[ImageTest, tuple[Picture, Picture]]]:
    """Tests with their pictures and references, those left out that cannot be compared."""
    for test in run.manifest.tests:
        if isinstance(test, ImageTest):
            asked = test.submitted
            try:
                reference = reference_picture(test.reference, run)
                _, picture = read_picture(run.submission, asked.file, asked.encoding, reference.size)
            except (GradingError, MissingExtraError):
                # The test itself reports it.
                continue
            if min(reference.size) >= LEAST_SIDE:
                yield test, (picture, reference)


def _pair(test: ImageTest, picture: Picture, reference: Picture) -> Pair:
    allowed = picture.rounding + reference.rounding + _tolerance(test)
    return Pair(picture.linear, reference.linear, allowed)


def _tolerance(test: ImageTest) -> float:
    return test.accept.tolerance if isinstance(test.accept, Verdict) else Policy().tolerance


def _with_ambient(test: ImageTest, pair: Pair, run: Run) -> Pair:
    try:
        scene = reference_scene(test.reference, run)
    except GradingError:
        return pair
    return pair if scene is None else replace(pair, ambient=ambient_term(scene, samples=1))


def _charged(found: ProgramMistake, program: Program, pictures: Sequence[str], run: Run) -> ProgramMistake:
    """A mistake with the tests in which it costs points: all of pictures if it cannot be undone."""
    tests = next(charge.tests for charge in run.manifest.charged_once if found.kind in charge.mistakes)
    if found.kind == "exposure" and not is_undone(program.scale):
        tests = tuple(pictures)
    return replace(found, charged=tuple(each for each in tests if found.cause not in _forgiven(run, each)))


def _forgiven(run: Run, test_id: str) -> tuple[str, ...]:
    """Mistakes that cost nothing in a test that judges their kind."""
    (accept,) = (test.accept for test in run.manifest.tests if test.id == test_id)
    return accept.forgiven if isinstance(accept, Verdict) else ()


def agree(image: Picture, reference: Picture, tolerance: float) -> bool:
    """Whether a picture agrees with its reference but for noise, so that there is nothing to find in it.

    One that is known to be wrong, such as one without anti-aliasing, does not agree.
    """
    found = Bias.joined(
        [
            bias(one.linear - other.linear, one.rounding + other.rounding + tolerance)
            for one, other in zip(image.bands(), reference.bands(), strict=True)
        ]
    )
    return found.share <= MOST_BIAS and not diagnose(image, reference, tolerance, MOST_BIAS)


def shared(pairs: Mapping[str, Pair], kinds: Collection[str]) -> ProgramMistakes:
    """The mistakes that the pictures of one program share, none of them charged.

    Parameters
    ----------
    pairs
        By test, with three pixels or more along each side.
    kinds
        Kinds of mistakes to look for.
    """
    search = _Search(pairs, kinds)
    glance = _Search({test: pair.thinned(GLANCE) for test, pair in pairs.items()}, kinds)
    closest = glance.displaced(search.needed(glance.pointwise()))
    program = search.needed(closest)
    if not search.explains(program):
        program = Program()
    jagged = search.jagged(program) if "antialiasing" in kinds else None
    if jagged is None:
        return ProgramMistakes(program, tuple(search.mistakes(program)))
    # A single sample at the corner lies half a pixel off.
    corner = closest.offset is not None and closest.offset.is_half
    program = program.without("offset") if corner else program
    hint = CORNER_HINT if corner else JAGGED_HINT
    found = *search.mistakes(program), ProgramMistake("antialiasing", JAGGED, hint, jagged)
    return ProgramMistakes(program, found)


class _Search:
    """Pictures and the kinds of mistakes that may be in them."""

    def __init__(self, pairs: Mapping[str, Pair], kinds: Collection[str]) -> None:
        self._tests, self._pairs, self._kinds = [*pairs], [*pairs.values()], kinds

    def pointwise(self) -> Program:
        """The closest program without an offset: all products of the other kinds are tried."""
        orders = (None, *(_causes(CHANNELS) if "channels" in self._kinds else ()))
        facings = (None, *(orientations(self._pairs) if "orientation" in self._kinds else ()))
        seen = {
            facing: [_means(Program(orientation=facing).facing(pair.image)) for pair in self._pairs]
            for facing in facings
        }
        best, least = Program(), math.inf
        for program in self._shades():
            made = [_means(program.predicted(pair)) for pair in self._pairs]
            for facing, order in product(facings, orders):
                both = zip(seen[facing], made, strict=True)
                distance = _distance([_square(Program(channels=order).facing(a) - b) for a, b in both])
                if distance < least:
                    best, least = replace(program, orientation=facing, channels=order), distance
        return best

    def _shades(self) -> Iterator[Program]:
        """Programs that differ in encoding, ambient term and exposure."""
        lightless = "ambient" in self._kinds and any(pair.ambient is not None for pair in self._pairs)
        encodings = (None, *(_causes(ENCODINGS) if "encoding" in self._kinds else ()))
        for encoding, dark in product(encodings, (False, True) if lightless else (False,)):
            program = Program(encoding=encoding, lightless=dark)
            yield program
            if "exposure" in self._kinds:
                scale = float(np.median([_exposure(program, pair) for pair in self._pairs]))
                if abs(scale - 1) >= LEAST_EXPOSURE:
                    yield replace(program, scale=scale)

    def displaced(self, program: Program) -> Program:
        """The same program with the closest offset."""
        if "offset" not in self._kinds:
            return program
        tried = [replace(program, offset=offset) for offset in (None, *DISPLACEMENTS)]
        return min(tried, key=lambda one: _distance([_square(_left(pair, one)) for pair in self._pairs]))

    def needed(self, program: Program) -> Program:
        """The program without mistakes that it can do without."""
        while True:
            weights = {kind: self._evidence(program, kind) for kind in program.kinds()}
            doubtful = {kind: _sum(errors) for kind, errors in weights.items() if not _convincing(errors)}
            if not doubtful:
                return program
            program = program.without(min(doubtful, key=doubtful.__getitem__))

    def mistakes(self, program: Program) -> Iterator[ProgramMistake]:
        """The mistakes of a program."""
        for kind in program.kinds():
            shows = self._where(errors > 0 for errors in self._evidence(program, kind))
            yield ProgramMistake(kind, *_named(program, kind), shows)

    def _where(self, shown: Iterable[bool]) -> frozenset[str]:
        return frozenset(compress(self._tests, shown))

    def jagged(self, program: Program) -> frozenset[str] | None:
        """Tests in which anti-aliasing is missing; None where that is no mistake of the program."""
        found = [_jagged(program, pair) for pair in self._pairs]
        votes = found.count(True), found.count(False)
        if votes[0] < max(LEAST_PICTURES, OUTWEIGHED * votes[1]):
            return None
        return self._where(vote is True for vote in found)

    def _evidence(self, program: Program, kind: str) -> list[float]:
        """By how many standard errors each picture is closer with the mistake than without it."""
        return [_rating(pair, program, program.without(kind)).errors for pair in self._pairs]

    def explains(self, program: Program) -> bool:
        """Whether at least half of the pictures that differ from their references agree with the program."""
        right = Program()
        differ = [pair for pair in self._pairs if not _agrees(pair, right)]
        explained = (_agrees(pair, program) or _rating(pair, program, right).is_clear for pair in differ)
        return 2 * sum(explained) >= len(differ)


def _named(program: Program, kind: str) -> tuple[str, str]:
    """Cause and hint of one of its mistakes."""
    if kind == "exposure":
        return EXPOSURE, exposure_hint(program.scale)
    if kind == "ambient":
        return "ambient_missing", AMBIENT_HINT
    if program.offset is not None and kind == "offset":
        return program.offset.cause, program.offset.hint
    cause = getattr(program, kind)
    return cause, MISTAKES[cause].hint


def _causes(mistakes: Sequence[Mistake]) -> tuple[str, ...]:
    return tuple(mistake.cause for mistake in mistakes)


def _means(picture: Floats) -> Floats:
    """Means of blocks, (rows, columns, 3)."""
    return gathered(picture).mean(axis=2)


def _square(difference: Floats) -> float:
    return float(np.mean(difference * difference))


def _distance(squares: Sequence[float]) -> float:
    """Negative log-likelihood of the mean squares of pictures, if each has an error variance of its own.

    A picture that is wrong in another way, too, counts as much as the others.
    """
    return float(np.log(np.array(squares) + FLOOR**2).sum())


def _exposure(program: Program, pair: Pair) -> float:
    """Exposure of a picture relative to the right one, by the mean, which noise does not change."""
    aim, emitted = float(np.mean(pair.image)), program.emitted(pair)
    scale, power = 1.0, 1.0
    before: tuple[float, float] | None = None
    for _ in range(STEPS):
        bright = float(np.mean(encoded(program.encoding, np.minimum(scale * emitted, 1))))
        if min(bright, aim) <= 0 or bright == aim:
            break
        if before is not None and before[0] != scale and before[1] != bright:
            power = math.log(bright / before[1]) / math.log(scale / before[0])
        before = scale, bright
        scale *= float(np.clip((aim / bright) ** (1 / max(power, LEAST_POWER)), 0.1, 10))
    return scale


def _left(pair: Pair, program: Program) -> Floats:
    return program.facing(pair.image) - program.predicted(pair)


def _agrees(pair: Pair, program: Program) -> bool:
    """Whether a picture is what the program makes but for noise."""
    return bias(_left(pair, program), pair.allowed).share <= AGREED


def _rating(pair: Pair, program: Program, other: Program) -> Rating:
    """The rating of a program against another one by one picture."""
    return Rating.of([(_left(pair, program), _left(pair, other), pair.allowed)])


def _sum(errors: Sequence[float]) -> float:
    """Standard errors of all pictures in which the mistake shows together (Stouffer 1949)."""
    shown = [error for error in errors if error]
    return sum(shown) / math.sqrt(len(shown)) if shown else 0.0


def _convincing(errors: Sequence[float]) -> bool:
    pro, contra = sum(error > CLEAR for error in errors), sum(error < -CLEAR for error in errors)
    return _sum(errors) >= MIN_GAIN_ERRORS and pro >= max(LEAST_PICTURES, OUTWEIGHED * contra)


def _jagged(program: Program, pair: Pair) -> bool | None:
    """Whether a picture lacks anti-aliasing; None where that cannot be seen."""
    image, reference = (
        program.undone(pair.image, pair.reference, pair.ambient),
        Picture.of_values(pair.reference),
    )
    if not has_soft_edges(reference):
        return None
    left = jagged_left_over(Picture.of_values(image), reference)
    return left is not None and left <= MAX_RMSE_LEFT**2 * _square(image - pair.reference)
