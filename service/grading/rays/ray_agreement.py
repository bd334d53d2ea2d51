"""Compare hits, up to the rounding of the arithmetic that found them.

A good intersection routine has a small backward error: its answer is exact for a ray shifted by a few units
in the last place of the coordinates. So each ray is shifted by that much in four perpendicular directions,
and the change of the exact answer is what rounding may cause. A ray that then hits another shape is
excluded, because rounding decides what it hits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from renderer import Hits, RenderPlan, trace
from renderer.math.arrays import Floats, Masks
from renderer.plan.building import compile_visibility
from service.grading.rays.ray_sources import RayList

ROUNDINGS = 1024
"""Units in the last place by which an intersection may shift a ray: transforms and a quadratic take some tens
of roundings, and transforms by badly scaled matrices some hundreds."""

UNIT = {"single": 2.0**-24, "double": 2.0**-53}
"""Largest relative error of one rounding."""

BESIDE = 2.0
"""Largest change along any direction, over the largest one along the four: at most the root of 2, plus some
room for curved surfaces."""


ONE_POINT, HALF_A_LIGHT = 1.0, 0.5
"""The visibility of a light may differ by one sample, which may lie on the border of a shadow; but a light
with a single sample is either visible or not."""


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """The right answers and their tolerances.

    Attributes
    ----------
    allowed : mapping of str to (N, ...) float64
        The allowed difference of each number of each field.
    doubtful : (N,) bool
        Rays for which rounding decides what they hit.
    """

    hits: Hits
    allowed: Mapping[str, Floats]
    doubtful: Masks


def relative(precision: str, tolerance: float | None) -> float:
    """The shift of a ray, relative to its coordinates."""
    return ROUNDINGS * UNIT[precision] if tolerance is None else tolerance


def answers(plan: RenderPlan, rays: RayList, share: float, fields: Sequence[str]) -> Answers:
    """Trace rays and their shifted copies.

    Parameters
    ----------
    share
        The relative shift, from `relative`.
    fields
        The fields that need tolerances.
    """
    hits = trace(plan, rays.origins, rays.directions)
    lengths = np.linalg.norm(rays.directions, axis=1)
    reach = np.where(np.isfinite(hits.t), hits.t * lengths, 0.0)
    size = np.linalg.norm(rays.origins, axis=1) + reach
    step = share * size
    floors = _floors(share, step / lengths, step, hits, plan)
    allowed = {name: floors[name] for name in fields if name != "shape"}
    doubtful = np.zeros(len(lengths), dtype=bool)
    for across in _across(rays.directions / lengths[:, None]):
        beside = trace(plan, rays.origins + step[:, None] * across, rays.directions)
        doubtful |= beside.shape != hits.shape
        for name, so_far in allowed.items():
            # For misses both numbers are infinite or NaN.
            with np.errstate(invalid="ignore"):
                change = np.abs(getattr(beside, name) - getattr(hits, name))
            allowed[name] = np.fmax(so_far, floors[name] + BESIDE * change)
    return Answers(hits, allowed, doubtful)


def agreement(submitted: Mapping[str, Floats], right: Answers) -> dict[str, Masks]:
    """For each field, which rays agree, (N,) bool; two misses agree in every field."""
    hits = right.hits
    missed = ~np.isfinite(hits.t)
    found = _missed(submitted)
    agrees = {}
    for name, values in submitted.items():
        agrees[name] = (missed & found) | (_near(values, name, right) & ~missed & ~found)
    return agrees


def _near(values: Floats, name: str, right: Answers) -> Masks:
    """Mask (N,) of the values of a field within the tolerance."""
    wanted = getattr(right.hits, name)
    if name == "shape":
        same: Masks = values == wanted
        return same
    with np.errstate(invalid="ignore"):
        return near(values, wanted, right.allowed[name])


def near(values: Floats, wanted: Floats, allowed: Floats) -> Masks:
    """Mask (N,) of the rows of values within a tolerance of others."""
    return _each_row(np.abs(values - wanted) <= allowed)


def _missed(submitted: Mapping[str, Floats]) -> Masks:
    """Mask of rays that miss: no distance or no shape; without both fields, by the first one."""
    found = {
        name: values < 0 if name == "shape" else ~_each_row(np.isfinite(values))
        for name, values in submitted.items()
    }
    told = [found[name] for name in ("t", "shape") if name in found] or [*found.values()][:1]
    return np.asarray(np.logical_or.reduce(told))


def _each_row(marks: Masks) -> Masks:
    """Mask (N,) of the rows of (N, ...) that are marked everywhere."""
    return np.asarray(marks.reshape(len(marks), -1).all(axis=1))


def _floors(share: float, t: Floats, step: Floats, hits: Hits, plan: RenderPlan) -> dict[str, Floats]:
    """Tolerances where shifting a ray changes nothing."""
    points = np.array([light.emitter.count for light in compile_visibility(plan)], dtype=np.float64)
    seen = np.minimum(ONE_POINT / np.maximum(points, 1), HALF_A_LIGHT)
    return {
        "t": t,
        "position": np.repeat(step[:, None], 3, axis=1),
        "normal": np.full(hits.normal.shape, share),
        "uv": np.full(hits.uv.shape, share),
        "visibility": np.tile(seen + share, (len(t), 1)),
    }


def _across(units: Floats) -> list[Floats]:
    """Four unit vectors perpendicular to each ray: two orthogonal axes, in both directions."""
    axis = np.zeros_like(units)
    axis[np.arange(len(units)), np.abs(units).argmin(axis=1)] = 1.0
    first = np.cross(units, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(units, first)
    return [first, -first, second, -second]
