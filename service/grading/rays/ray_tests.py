"""Tests of the kind `rays`: compare submitted hits with `renderer.trace`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace

import numpy as np

from renderer import RenderPlan, compile_scene, load_scene, trace
from renderer.errors import SceneError
from renderer.math.arrays import Floats, Masks
from schemas.grading.manifests import HitsFile, RaysTest
from service.grading import sentences
from service.grading.errors import BrokenTestError, NotGradableError
from service.grading.folders import Folder
from service.grading.outcomes import Outcome, by_number, of_file
from service.grading.rays.ray_agreement import Answers, agreement, answers, relative
from service.grading.rays.ray_mistakes import reasons_of
from service.grading.rays.ray_sources import RayList, rays_of, read_arrays
from service.grading.settings import Run


def rays(test: RaysTest, run: Run) -> Iterator[Outcome]:
    """Compare what rays hit in the submission and in the reference scene."""
    plan = _plan(run.references, test.reference)
    cast = rays_of(test.rays, plan.document.camera, run.references)
    try:
        right = answers(plan, cast, relative(test.precision, test.tolerance), test.fields)
    except ValueError as error:
        raise BrokenTestError(f"These rays cannot be traced: {error}") from error
    submitted = _submitted(test, run, cast, right)
    agrees = agreement(submitted, right)
    sure = ~right.doubtful
    if not sure.any():
        raise BrokenTestError("The hit of every ray depends on rounding. Choose other rays.")
    good = np.logical_and.reduce(list(agrees.values()))
    value = float(np.count_nonzero(good & sure)) / np.count_nonzero(sure)
    outcome = by_number("agreeing_rays", value, test.accept)
    reasons = [] if outcome.share == 1.0 else reasons_of(submitted, right, agrees, cast, plan.document)
    yield replace(
        outcome,
        message=sentences.joined(_counted(good, sure), *reasons),
        metrics=_numbers(agrees, sure),
        inputs=(
            of_file(
                test.id,
                "submission",
                test.submitted.file,
                run.submission.read(test.submitted.file),
                submitted if isinstance(test.submitted, HitsFile) else None,
            ),
            of_file(test.id, "reference", test.reference, run.references.read(test.reference)),
        ),
    )


def _plan(folder: Folder, name: str) -> RenderPlan:
    try:
        return compile_scene(load_scene(folder.read(name), assets=folder.assets(name)))
    except SceneError as error:
        raise folder.fault(f"{name} is not a usable scene. {error}") from error


def _submitted(test: RaysTest, run: Run, cast: RayList, right: Answers) -> Mapping[str, Floats]:
    name = test.submitted.file
    if isinstance(test.submitted, HitsFile):
        found = read_arrays(run.submission, name, test.fields)
    else:
        hits = trace(_plan(run.submission, name), cast.origins, cast.directions)
        found = {field: np.asarray(asdict(hits)[field], dtype=np.float64) for field in test.fields}
    for field, values in found.items():
        wanted = getattr(right.hits, field).shape
        if values.shape != wanted:
            raise NotGradableError(
                f"{name}: '{field}' has the shape {values.shape}. For these rays it must be {wanted}."
            )
    hit = found.get("t")
    if hit is not None and np.isnan(hit).any():
        row = int(np.flatnonzero(np.isnan(hit))[0])
        raise NotGradableError(f"{name}: 't' is NaN in row {row}. A ray that hits nothing has t = inf.")
    return found


def _numbers(agrees: Mapping[str, Masks], sure: Masks) -> dict[str, float | None]:
    total = np.count_nonzero(sure)
    shares = {
        f"agree_{name}": float(np.count_nonzero(those & sure)) / total for name, those in agrees.items()
    }
    return {"rays": float(sure.size), "doubtful": float(sure.size - total), **shares}


def _counted(good: Masks, sure: Masks) -> str:
    total, left_out = np.count_nonzero(sure), np.count_nonzero(~sure)
    doubtful = f"; {left_out} are excluded, because their hits depend on rounding" if left_out else ""
    return f"{np.count_nonzero(good & sure)} of {total} rays agree{doubtful}."
