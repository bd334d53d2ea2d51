"""The kinds `image` and `scene`: a picture against its reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from numpy.typing import NDArray

from renderer.comparison import Comparison, NotComparableError, Picture, picture_of
from renderer.comparison.heat import encoded, side_by_side
from renderer.comparison.regions import named
from renderer.comparison.shown import names_of, shapes_shown
from renderer.errors import ImageFileError, MissingExtraError, SceneError
from renderer.scenes import load_scene
from schemas.comparisons import ComparisonCause, ComparisonRegion, Encoding
from schemas.grades import GradeInput
from schemas.manifests import ImageTest, ReferencePicture, SceneTest
from service.grading import sentences
from service.grading.accepting import accepted, compared
from service.grading.errors import BrokenTestError, NotGradableError
from service.grading.folders import Folder
from service.grading.inputs import of_picture
from service.grading.outcomes import Outcome
from service.grading.references import word_of
from service.grading.rendering import rendered
from service.grading.selection import Selection, select
from service.grading.settings import Run

LABEL = "picture, reference, difference"

_Seen = ImageTest | SceneTest


@dataclass(frozen=True, slots=True)
class _Reference:
    """A reference with the names of what is seen in it; `size` is that of its file, if it has one."""

    picture: Picture
    size: int | None
    names: Sequence[str]


def image(test: ImageTest, run: Run) -> Outcome:
    """A submitted picture against its reference."""
    file = test.submitted
    content, picture = _read(run.submission, file.file, file.encoding)
    return _graded(test, run, picture, of_picture(test.id, "submission", picture, len(content)))


def scene(test: SceneTest, run: Run) -> Outcome:
    """A submitted scene, rendered, against its reference."""
    made = rendered(run.submitted(test.submitted, test))
    picture = picture_of(made.content(), test.submitted.file, "linear", made.layers)
    return _graded(test, run, picture, of_picture(test.id, "submission", picture, None))


def _graded(test: _Seen, run: Run, picture: Picture, read: GradeInput) -> Outcome:
    reference = _reference(test, run)
    mask = None if test.mask is None else _read(run.references, test.mask, "linear")[1]
    selection = select(reference.picture, test.region, mask)
    try:
        whole = compared(test.accept, picture, reference.picture)
        part = whole
        if test.region is not None or mask is not None:
            part = compared(test.accept, *selection.pair(picture, reference.picture), selection.blocks)
    except MissingExtraError as error:
        raise BrokenTestError(str(error)) from error
    except NotComparableError as error:
        raise NotGradableError(str(error)) from error
    outcome = accepted(test.accept, part, selection)
    # A mistake with the whole picture explains its parts better than they do themselves.
    causes = tuple(
        ComparisonCause.model_validate(cause, from_attributes=True) for cause in whole.causes or part.causes
    )
    regions = _regions(part, selection, reference.names)
    explanation = "" if outcome.share == 1.0 else sentences.explained(causes, regions)
    return replace(
        outcome,
        message=sentences.joined(outcome.message, explanation),
        verdict=part.judgement.verdict,
        samples_to_settle=part.judgement.samples_factor,
        diagnosis=causes,
        worst_regions=regions,
        pictures=_drawn(whole) if run.pictures else {},
        inputs=(read, of_picture(test.id, "reference", reference.picture, reference.size)),
    )


def _regions(part: Comparison, selection: Selection, names: Sequence[str]) -> tuple[ComparisonRegion, ...]:
    known = [*names, *part.names[len(names) :]]
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
            name=named(region.shape, known),
        )
        for region in part.regions
    )
    return tuple(map(selection.moved, found))


def _reference(test: _Seen, run: Run) -> _Reference:
    wanted = test.reference
    if isinstance(wanted, ReferencePicture):
        content, picture = _read(run.references, wanted.file, wanted.encoding)
        if wanted.scene is not None:
            shapes, names = _shown(run.references, wanted.scene)
            return _Reference(_with_shapes(picture, shapes, wanted.scene), len(content), names)
        return _Reference(picture, len(content), ())
    picture = run.reference(word_of(wanted)).picture(wanted.file)
    return _Reference(picture, None, _names(run.references, wanted.file))


def _read(folder: Folder, name: str, encoding: Encoding) -> tuple[bytes, Picture]:
    content = folder.read(name)
    try:
        return content, picture_of(content, name, encoding)
    except ImageFileError as error:
        raise folder.fault(str(error)) from error


def _shown(folder: Folder, name: str) -> tuple[NDArray[Any], Sequence[str]]:
    try:
        scene = load_scene(folder.read(name), assets=folder.assets(name))
        return shapes_shown(scene), names_of(scene.document)
    except SceneError as error:
        raise folder.fault(f"{name} is no usable scene. {error}") from error


def _names(folder: Folder, name: str) -> Sequence[str]:
    return names_of(load_scene(folder.read(name), assets=folder.assets(name)).document)


def _with_shapes(picture: Picture, shapes: NDArray[Any], name: str) -> Picture:
    if shapes.shape != picture.linear.shape[:2]:
        raise BrokenTestError(f"{name} asks for another size than {picture.name} has.")
    return replace(picture, layers={**picture.layers, "shape": shapes})


def _drawn(found: Comparison) -> dict[str, bytes]:
    return {LABEL: encoded(side_by_side(found.image.linear, found.reference.linear))}
