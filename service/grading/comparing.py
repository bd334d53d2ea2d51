"""Tests of the kinds `image` and `scene`: compare a picture with its reference."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from accuracy.comparison import Comparison, NotComparableError, Picture, picture_of
from accuracy.comparison.diagnosis import Cause
from accuracy.comparison.heat import encoded, side_by_side
from accuracy.comparison.regions import Region, named
from renderer.errors import MissingExtraError
from schemas.api.comparisons import ComparisonCause, ComparisonRegion
from schemas.grading.manifests import ImageTest, SceneTest
from service.grading import sentences
from service.grading.accepting import accepted, compared, noiseless
from service.grading.counterfactuals import explain, is_certain
from service.grading.errors import BrokenTestError, NotGradableError
from service.grading.forgiving import forgiven
from service.grading.inputs import of_picture
from service.grading.outcomes import Outcome
from service.grading.rendering import rendered
from service.grading.selection import Selection, select
from service.grading.settings import Run
from service.grading.signals import signals
from service.grading.wanted import Wanted, read_picture, wanted

LABEL = "picture, reference, difference"


def image(test: ImageTest, run: Run) -> Iterator[Outcome]:
    """Compare a submitted picture with its reference: yield what it earns, then the same with its cause."""
    file = test.submitted
    content, picture = read_picture(run.submission, file.file, file.encoding)
    # Noise layers of the submission would influence its own verdict.
    yield from _graded(test, run, noiseless(picture), content)


def scene(test: SceneTest, run: Run) -> Iterator[Outcome]:
    """Render a submitted scene and compare it with its reference, in the same two steps."""
    made = rendered(run.submitted(test.submitted, test))
    picture = picture_of(made.content(), test.submitted.file, "linear", made.layers)
    yield from _graded(test, run, picture, None)


@dataclass(frozen=True, slots=True)
class _Found:
    """The results of a comparison.

    Attributes
    ----------
    whole : Comparison
        Of the whole picture, unchanged.
    part : Comparison
        Of the part that is judged.
    pardon : str
        The mistake that was undone first, as a sentence; empty if none was.
    """

    whole: Comparison
    part: Comparison
    pardon: str

    @property
    def causes(self) -> tuple[Cause, ...]:
        """Probable mistakes; the whole picture gives better evidence than a part of it."""
        return self.part.causes if self.pardon else self.whole.causes or self.part.causes

    @property
    def judged(self) -> Comparison:
        """The judged part if it has the size of the whole picture, else the whole."""
        sizes = [found.image.linear.shape for found in (self.part, self.whole)]
        return self.part if sizes[0] == sizes[1] else self.whole


def _graded(
    test: ImageTest | SceneTest, run: Run, picture: Picture, content: bytes | None
) -> Iterator[Outcome]:
    """What a picture earns; `content` is its file, None if it was rendered here."""
    reference = wanted(test.reference, run)
    mask = None if test.mask is None else read_picture(run.references, test.mask, "linear")[1]
    selection = select(reference.picture, test.region, mask)
    found = _compared(test, picture, reference, selection)
    held_to = None if reference.file is None else len(reference.file)
    outcome = replace(
        accepted(test.accept, found.part, selection),
        verdict=found.part.judgement.verdict,
        samples_to_settle=found.part.judgement.samples_factor,
        worst_regions=_regions(found.part.regions, selection, [*reference.names, *found.part.names]),
        pictures=_drawn(found.whole) if run.pictures else {},
        inputs=(
            of_picture(test.id, "submission", picture, None if content is None else len(content)),
            of_picture(test.id, "reference", reference.picture, held_to),
        ),
        signals=() if content is None else signals(content, reference.file, found.whole, test=test.id),
    )
    if outcome.share == 1.0 or reference.scene is None:
        yield _explained(outcome, found, found.causes)
        return
    # Kept if the deadline ends the trials: a name that they might refute must not depend on it.
    yield _explained(outcome, found, found.causes if is_certain(found.causes) else ())
    yield _explained(outcome, found, explain(reference.scene, found.judged))


def _explained(outcome: Outcome, found: _Found, causes: Sequence[Cause]) -> Outcome:
    """The outcome with its diagnosis and an explanation."""
    diagnosis = tuple(ComparisonCause.model_validate(cause, from_attributes=True) for cause in causes)
    reason = "" if outcome.share == 1.0 else sentences.explained(diagnosis, outcome.worst_regions)
    message = sentences.joined(outcome.message, found.pardon, reason)
    return replace(outcome, message=message, diagnosis=diagnosis)


def _compared(
    test: ImageTest | SceneTest, picture: Picture, reference: Wanted, selection: Selection
) -> _Found:
    try:
        whole = compared(test.accept, picture, reference.picture)
        judged, pardon = forgiven(test.accept, whole)
        if not pardon and test.region is None and test.mask is None:
            return _Found(whole, whole, pardon)
        pair = selection.pair(judged, reference.picture)
        return _Found(whole, compared(test.accept, *pair, selection.blocks), pardon)
    except MissingExtraError as error:
        raise BrokenTestError(str(error)) from error
    except NotComparableError as error:
        raise NotGradableError(str(error)) from error


def _regions(
    regions: Sequence[Region], selection: Selection, names: Sequence[str]
) -> tuple[ComparisonRegion, ...]:
    found = (
        ComparisonRegion(
            x0=region.x0,
            y0=region.y0,
            x1=region.x1,
            y1=region.y1,
            share=region.share,
            rmse=region.rmse,
            brightness=region.brightness,
            shape=region.shape,
            name=named(region.shape, names),
        )
        for region in regions
    )
    return tuple(map(selection.moved, found))


def _drawn(found: Comparison) -> dict[str, bytes]:
    return {LABEL: encoded(side_by_side(found.image.linear, found.reference.linear))}
