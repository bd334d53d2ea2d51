"""Hard cases: cameras. Those of the lens are here; the module that is imported brings the others along."""

from typing import Any

import mpmath
import numpy as np

from accuracy.hard_cases.camera_bases import SECTION
from accuracy.hard_cases.camera_rays import centres, differing, off, view_of
from accuracy.hard_cases.cases import Outcome, total
from renderer.cameras import Pinhole
from renderer.cameras.thin_lens import ThinLens, disk
from renderer.math.arrays import Floats


@SECTION.case(
    "a lens far from the origin",
    symptom="What is in focus is blurred or in steps, the more the farther the camera is from the origin.",
    cause="A ray from a place on the lens to a point in focus is a difference of two points, each rounded "
    "to the spacing of the position.",
    remedy="A direction is the pinhole's less the place on the lens over the distance of the focus.",
    expected="The same directions as at the origin, bit for bit. A formula's may be off by 1/1000 pixel.",
    source="geometry",
)
def lens_far_from_the_origin() -> Outcome:
    """As for the pinhole, with a place on the lens for each pixel."""
    outcomes = []
    for place in ([1e7] * 3, [9e14, -8e14, 7e14]):
        look_at = [place[0] + 4, place[1] - 2, place[2] - 10]
        lens = {"vertical_fov": 60, "width": 640, "height": 480, "lens_radius": 0.5}
        here = view_of(position=[0, 0, 0], look_at=[4, -2, -10], **lens)
        there = view_of(position=place, look_at=look_at, **lens)
        x, y = centres(640, 3)
        pixels = np.arange(x.size)
        samples = pixels % 16
        true, found = (view.rays(x, y, pixels, samples)[1] for view in (here, there))
        plain = (off(here, between_points(there, x, y, samples, d), true) for d in (np.float64, np.float32))
        outcomes.append(Outcome(x.size, differing(found, true), *plain))
    return total(outcomes)


def between_points(view: Pinhole, x: Floats, y: Floats, samples: Any, dtype: type[np.floating]) -> Floats:
    """Directions (3, N) from places on the lens to points in focus, as differences of points."""
    assert isinstance(view, ThinLens)
    position = view.position.astype(dtype)
    origins = view.rays(x, y, np.arange(x.size), samples)[0].astype(dtype)
    focus = dtype(view.focus)
    return (position + focus * view.directions(x, y).astype(dtype) - origins) / focus


@SECTION.case(
    "the middle of the lens",
    symptom="A pixel that is NaN, once in very many samples.",
    cause="The map from the square to the disk divides one coordinate by the other, and both are 0.",
    remedy="The quotient is taken as 0 there.",
    expected="Places within 4 eps of the map's, of radius 1, which keeps areas.",
    source="Shirley, Chiu 1997, A low distortion map between disk and square; to 50 digits",
)
def middle_of_the_lens() -> Outcome:
    """Places on the axes, on the diagonals, at the corners and in the middle."""
    steps = np.arange(33) / 32
    a, b = (c.ravel() for c in np.meshgrid(steps, steps))
    true = np.array([on_the_disk(2 * p - 1, 2 * q - 1) for p, q in zip(a, b, strict=True)]).T
    with np.errstate(all="ignore"):
        plain = [plain_disk((2 * a - 1).astype(d), (2 * b - 1).astype(d)) for d in (np.float64, np.float32)]
    counts = [
        int(np.count_nonzero(~(np.abs(np.array(found) - true).max(axis=0) <= 4 * np.finfo(dtype).eps)))
        for found, dtype in ((disk(a, b), np.float64), (plain[0], np.float64), (plain[1], np.float32))
    ]
    return Outcome(a.size, *counts)


def on_the_disk(x: float, y: float) -> tuple[float, float]:
    """The map to 50 digits."""
    radius, other = (x, y) if abs(x) > abs(y) else (y, x)
    turn = mpmath.pi / 4 * mpmath.mpf(other) / radius if radius else mpmath.mpf(0)
    near, far = float(radius * mpmath.cos(turn)), float(radius * mpmath.sin(turn))
    return (near, far) if abs(x) > abs(y) else (far, near)


def plain_disk(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """The map as published, (N,) and (N,)."""
    wide = np.abs(x) > np.abs(y)
    radius = np.where(wide, x, y)
    quarter = x.dtype.type(np.pi / 4)
    turn = np.where(wide, quarter * (y / x), 2 * quarter - quarter * (x / y))
    return radius * np.cos(turn), radius * np.sin(turn)
