"""Tests of the kinds `image` and `scene`: compare a picture with its reference."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace

from accuracy.comparison import Comparison, NotComparableError, Picture, picture_of, variances
from accuracy.comparison.diagnosis import LOSSY, Cause, predicted
from accuracy.comparison.heat import encoded, heat_map, side_by_side
from accuracy.comparison.regions import named
from renderer.errors import MissingExtraError
from renderer.scenes import load_scene
from schemas.api.comparisons import ComparisonCause, ComparisonRegion
from schemas.grading.acceptance import Acceptance, Verdict
from schemas.grading.manifests import ImageTest, SceneTest
from service.grading import sentences
from service.grading.accepting import accepted, compared, noiseless
from service.grading.errors import BrokenTestError, NotGradableError
from service.grading.likeness.fingerprints import Fingerprint, fingerprint
from service.grading.likeness.marks import marked
from service.grading.likeness.signals import signals, signals_of_scene
from service.grading.mistakes.counterfactuals import explain, is_certain
from service.grading.outcomes import DIFFERENCE, Outcome, of_picture
from service.grading.programs.program import ProgramMistake
from service.grading.references import Wanted, read_picture, wanted
from service.grading.rendering import rendered
from service.grading.repairing import Pardon, Repair, pardoned
from service.grading.selection import Selection, evidence, select
from service.grading.settings import Run

LABEL = "picture, reference, difference"


def image(test: ImageTest, run: Run) -> Iterator[Outcome]:
    """Compare a submitted picture with its reference: yield what it earns, then the same with its cause."""
    file = test.submitted
    # A submission that lacks the picture is no fault of the reference.
    run.submission.path(file.file)
    reference = wanted(test.reference, run)
    stored, picture = read_picture(run.submission, file.file, file.encoding, reference.picture.size)
    # Noise layers of the submission would influence its own verdict.
    yield from _graded(test, run, noiseless(picture), reference, stored)


def scene(test: SceneTest, run: Run) -> Iterator[Outcome]:
    """Render a submitted scene and compare it with its reference, in the same two steps."""
    made = rendered(run.submitted(test.submitted, test))
    picture = picture_of(made.content(), test.submitted.file, "linear", made.layers)
    file, folder = test.submitted.file, run.submission
    handed_in = load_scene(folder.read(file), assets=folder.assets(file))
    reference = wanted(test.reference, run)
    found = signals_of_scene(handed_in, reference.picture, test=test.id)
    for outcome in _graded(test, run, picture, reference, None):
        yield replace(outcome, signals=found)


@dataclass(frozen=True, slots=True)
class _Found:
    """The results of comparing a picture: all of it but in `part`, which is judged."""

    submitted: Comparison
    # Without mistakes of the program that other tests charge, and without any.
    whole: Comparison
    right: Comparison
    part: Comparison
    selection: Selection
    pardon: Pardon
    # Whether enough of the picture is left to judge it without its mistakes.
    enough: bool

    @property
    def causes(self) -> tuple[Cause, ...]:
        """Probable mistakes; the whole picture gives better evidence than a part of it."""
        return self.part.causes if self.is_forgiven else self.whole.causes or self.part.causes

    @property
    def lossy(self) -> tuple[Cause, ...]:
        """The lossy format that is forgiven, whose losses may still cost points."""
        return tuple(each for each in self.whole.causes if each.cause == self.pardon.cause == LOSSY)

    @property
    def is_forgiven(self) -> bool:
        """Whether a mistake is forgiven that does not explain what costs points."""
        too_noisy = not self.part.passed and self.part.judgement.test == "noise"
        return bool(self.pardon.cause) and not (too_noisy and self.pardon.is_noisy)

    @property
    def judged(self) -> Comparison:
        """The judged part if it has the size of the whole picture, else the whole."""
        if self.pardon.cause and not self.is_forgiven:
            return self.whole
        sizes = [found.image.size for found in (self.part, self.whole)]
        return self.part if sizes[0] == sizes[1] else self.whole

    def explained(self) -> _Found:
        """The same with a cause that explains why a number failed, though the pictures may agree."""
        whole = self.whole
        if whole.causes or not variances.known(whole.reference):
            return self
        policy = whole.policy
        causes = predicted(whole.image, whole.reference, policy.tolerance, policy.most_bias)
        named = replace(whole, causes=causes)
        return replace(self, whole=named, part=named if self.part is whole else self.part)

    def charged(self, mistakes: Sequence[ProgramMistake]) -> tuple[Cause, ...]:
        """Mistakes of the program as causes."""
        before, after = self.whole.metrics.rmse, self.right.metrics.rmse
        return tuple(Cause(each.cause, each.hint, before, after) for each in mistakes)


def _graded(
    test: ImageTest | SceneTest, run: Run, picture: Picture, reference: Wanted, stored: int | None
) -> Iterator[Outcome]:
    """Points of a picture; `stored` are the bytes of its file, None if it was rendered here."""
    mask = None if test.mask is None else read_picture(run.references, test.mask, "linear")[1]
    selection = select(reference.picture, test.region, mask)
    found = _compared(test, run, picture, reference, selection)
    charged = found.charged(run.mistakes.charged(test.id))
    earned = _earned(test.accept, found)
    if earned.share < 1.0 and not isinstance(test.accept, Verdict):
        found = found.explained()
    outcome = replace(
        earned,
        verdict=found.part.judgement.verdict,
        samples_to_settle=found.part.judgement.samples_factor,
        worst_regions=_regions(found, [*reference.names, *found.part.names]),
        pictures=_drawn(found.submitted) if run.pictures else {},
        inputs=(
            of_picture(test.id, "submission", picture, stored),
            of_picture(test.id, "reference", reference.picture, reference.stored),
        ),
        signals=() if stored is None else signals(found.submitted, test=test.id),
        fingerprint=None if stored is None else _fingerprint(found, reference),
    )
    pardon = _judged_without(test, run)
    if found.is_forgiven:
        pardon = sentences.joined(pardon, found.pardon.sentence(passed=found.part.passed))
    undone = () if charged else found.causes
    if outcome.share == 1.0 or reference.scene is None:
        yield _explained(outcome, pardon, charged, undone)
        return
    # Kept if the deadline ends the trials: a name that they might refute must not depend on it.
    yield _explained(outcome, pardon, charged, undone if is_certain(undone) else ())
    if not charged:
        causes = explain(reference.scene, found.judged, keep=run.keep) or found.lossy
        yield _explained(outcome, pardon, (), causes)
    elif not pardoned(test.accept, found.right).cause and not found.right.passed:
        others = explain(reference.scene, found.right, keep=run.keep)
        yield _explained(outcome, pardon, charged, others)


def _judged_without(test: ImageTest | SceneTest, run: Run) -> str:
    """A sentence about the program's mistakes that other tests charge."""
    visible = {other.id for other in run.manifest.tests if not other.hidden}
    undone = run.mistakes.undone(test.id)
    return sentences.judged_without(
        [each.cause for each in undone],
        dict.fromkeys(name for each in undone for name in each.charged if name in visible),
    )


def _explained(outcome: Outcome, pardon: str, charged: Sequence[Cause], causes: Sequence[Cause]) -> Outcome:
    """The outcome with its diagnosis and an explanation: mistakes of the program first, all of them named."""
    diagnosis = tuple(
        ComparisonCause.model_validate(cause, from_attributes=True) for cause in (*charged, *causes)
    )
    named = diagnosis[: max(1, len(charged))]
    reason = "" if outcome.share == 1.0 else sentences.explained(named, outcome.worst_regions)
    message = sentences.joined(outcome.message, pardon, reason)
    return replace(outcome, message=message, diagnosis=diagnosis)


def _fingerprint(found: _Found, reference: Wanted) -> Fingerprint | None:
    """Of the picture without mistakes of its program; none if another remains, which others may share."""
    if found.right.causes and not found.pardon.cause:
        return None
    return fingerprint(found.right.image, reference.picture)


def _earned(accept: Acceptance, found: _Found) -> Outcome:
    """Points of the judged part: none where too little of the picture is left to judge."""
    outcome = accepted(accept, found.part, found.selection)
    return outcome if found.enough else replace(outcome, share=0.0, message=sentences.TOO_LITTLE)


def _compared(
    test: ImageTest | SceneTest, run: Run, picture: Picture, reference: Wanted, selection: Selection
) -> _Found:
    accept, mistakes = test.accept, run.mistakes
    undone, charged = mistakes.undone(test.id), mistakes.charged(test.id)
    repair = Repair.of(reference, mistakes, undone, run.keep)
    try:
        submitted = compared(accept, picture, reference.picture)
        whole = compared(accept, *repair.pair(picture)) if undone else submitted
        pardon = pardoned(accept, whole)
        judged, left = pardon.picture(whole.image), None
        if undone or pardon.cause:
            left = evidence(
                picture,
                judged,
                whole.reference,
                lambda values: pardon.undo(repair.linear(values)),
                submitted.policy.tolerance,
            )
        enough = left is None or left.is_enough(selection.mask(reference.picture))
        if left is not None and enough:
            selection = selection.among(left.left)
        part = whole
        if left is not None or test.region is not None or test.mask is not None:
            pair = selection.pair(judged, pardon.reference(whole.reference))
            part = compared(accept, *pair, selection.blocks)
        right = whole
        if charged:
            every = Repair.of(reference, mistakes, (*undone, *charged), run.keep)
            right = compared(accept, *every.pair(picture))
        return _Found(submitted, whole, right, part, selection, pardon, enough)
    except MissingExtraError as error:
        raise BrokenTestError(str(error)) from error
    except NotComparableError as error:
        raise NotGradableError(str(error)) from error


def _regions(found: _Found, names: Sequence[str]) -> tuple[ComparisonRegion, ...]:
    """Regions of the judged part that differ most; none if it says too little."""
    regions = (
        ComparisonRegion(**asdict(region), name=named(region.shape, names))
        for region in (found.part.regions if found.enough else ())
    )
    return tuple(map(found.selection.moved, regions))


def _drawn(found: Comparison) -> dict[str, bytes]:
    image, reference = found.image, marked(found.reference)
    drawings = {LABEL: side_by_side, DIFFERENCE: heat_map}
    return {name: encoded(draw, image, reference) for name, draw in drawings.items()}
