"""Hard cases: from a pixel to its ray."""

import math
from typing import Any

import mpmath
import numpy as np

import renderer
from accuracy.hard_cases.camera_bases import SECTION, let_through
from accuracy.hard_cases.cases import Outcome, total
from accuracy.hard_cases.documents import camera, sampled, scene
from renderer.cameras import Pinhole
from renderer.math.arrays import Floats, dot

VISIBLE = 1e-3
"""Pixels by which a ray of a formula may be off: nobody sees it."""


def view_of(**changes: Any) -> Pinhole:
    """The camera of a plan."""
    sampling = sampled(samples=16, pattern="random")
    written = scene(camera=camera(**changes), sampling=sampling)
    return renderer.compile_scene(renderer.load_scene(written)).camera


def centres(columns: int, rows: int) -> tuple[Floats, Floats]:
    """Raster positions of the pixels in the upper left of a picture, (N,) and (N,)."""
    y, x = np.indices((rows, columns), dtype=np.float64).reshape(2, -1) + 0.5
    return x, y


def through_the_screen(
    view: Pinhole, x: Floats, y: Floats, dtype: type[np.floating], focal_length: float = 1.0
) -> Floats:
    """Directions (3, N) of length 1 from the camera to points of a screen at the focal length."""
    with np.errstate(all="ignore"):
        position, right, up, forward = (
            v.astype(dtype) for v in (view.position, view.right, view.up, view.forward)
        )
        across = dtype(view.half_width) * (2 * x.astype(dtype) / view.width - 1)
        along = dtype(view.half_height) * (1 - 2 * y.astype(dtype) / view.height)
        away = position + dtype(focal_length) * (forward + right * across + up * along) - position
        return away / np.sqrt(dot(away, away))


def off(view: Pinhole, found: Floats, true: Floats) -> int:
    """Directions that miss the true ones on the screen by more than `VISIBLE` pixels, or are none."""
    pixel = 2 * view.half_height / view.height
    with np.errstate(all="ignore"):
        places, expected = (d / dot(d, view.forward) for d in (found.astype(np.float64), true))
        right = np.abs(places - expected).max(axis=0) <= VISIBLE * pixel
    return int(np.count_nonzero(~right))


def differing(a: Floats, b: Floats) -> int:
    """Columns that are not the same bit for bit."""
    return int(np.count_nonzero((a != b).any(axis=0)))


@SECTION.case(
    "field of view at its ends",
    symptom="One colour all over: every pixel has the same ray. Or a picture of noise, beyond half a turn.",
    cause="The tangent of 0 is 0, that of 90 degrees is 1.6e16 and not infinite, so nothing fails; in "
    "float32 the step from pixel to pixel of a narrow view is below the spacing of directions.",
    remedy="More than 0 and less than 180 degrees are accepted, nothing else; directions are float64.",
    expected="An error that names vertical_fov; at 0.001 and 179.99 degrees as many finite directions as "
    "pixels.",
    source="geometry",
)
def ends_of_the_field_of_view() -> Outcome:
    """640 columns from a turned camera."""
    refused = let_through(
        ({"vertical_fov": fov} for fov in (0, -10, 180, 200, math.nan, math.inf)), "/camera/vertical_fov"
    )
    outcomes = [refused]
    for fov in (1e-3, 179.99):
        view = view_of(position=[3, 1, 4], look_at=[1, 5, 9], vertical_fov=fov, width=640, height=640)
        x, y = centres(640, 10)
        missing = [
            x.size - len(np.unique(directions[:, np.isfinite(directions).all(axis=0)], axis=1).T)
            for directions in (
                view.directions(x, y),
                *(through_the_screen(view, x, y, dtype) for dtype in (np.float64, np.float32)),
            )
        ]
        outcomes.append(Outcome(x.size, *missing))
    return total(outcomes)


@SECTION.case(
    "a camera far from the origin",
    symptom="Columns of pixels repeat each other, and the picture shakes when the camera moves.",
    cause="A point of the screen is the camera's position plus an offset, rounded to the spacing of the "
    "position; in float32 all 640 columns become one.",
    remedy="A direction is formed from right, up and forward alone, and the origin is kept apart.",
    expected="The same directions as at the origin, bit for bit. A formula's may be off by 1/1000 pixel.",
    source="geometry",
)
def far_from_the_origin() -> Outcome:
    """Ten million units away, and as far as the scene language goes."""
    outcomes = []
    for place in ([1e7] * 3, [-(2.0**40), 3e12, 1e11], [9e14, -8e14, 7e14]):
        look_at = [place[0] + 4, place[1] - 2, place[2] - 10]
        sizes = {"vertical_fov": 60, "width": 640, "height": 480}
        here = view_of(position=[0, 0, 0], look_at=[4, -2, -10], **sizes)
        there = view_of(position=place, look_at=look_at, **sizes)
        x, y = centres(640, 3)
        true = here.directions(x, y)
        plain = (off(there, through_the_screen(there, x, y, d), true) for d in (np.float64, np.float32))
        outcomes.append(Outcome(x.size, differing(there.directions(x, y), true), *plain))
    return total(outcomes)


SIZES = ((1920, 1), (1, 1080), (1, 1), (3, 2), (2, 3), (8192, 1))


@SECTION.case(
    "pictures of one row, one column, one pixel",
    symptom="The picture of a mirrored scene is not the mirrored picture; where width less 1 divides, one "
    "of a single column is black.",
    cause="2 x / width - 1 cancels next to the middle, and rounds differently to its left and to its right.",
    remedy="A place is (2 x - width) / width of half the screen, for pixel centres x = i + 1/2.",
    expected="Places within 4 eps of themselves; those opposite each other differ in sign alone, and the "
    "middle of an odd number is 0.",
    source="geometry, to 50 digits",
)
def thin_pictures() -> Outcome:
    """Places of all columns and rows."""
    outcomes = []
    for width, height in SIZES:
        view = view_of(vertical_fov=50, width=width, height=height)
        half = mpmath.tan(mpmath.radians(25))
        across, down = view.screen(*(np.arange(n, dtype=np.float64) + 0.5 for n in (width, height)))
        for count, side, found in ((width, half * width / height, across), (height, half, -down)):
            true = np.array([float(side * (2 * i + 1 - count) / count) for i in range(count)])
            plain = (plain_places(count, side, dtype) for dtype in (np.float64, np.float32))
            outcomes.append(Outcome(count, *(misplaced(places, true) for places in (found, *plain))))
    return total(outcomes)


def plain_places(count: int, side: Any, dtype: type[np.floating]) -> Floats:
    """Pixel centres from -side to side, as a share of the screen less 1."""
    x = np.arange(count, dtype=dtype) + dtype(0.5)
    return dtype(side) * (2 * x / dtype(count) - 1)


def misplaced(places: Floats, true: Floats) -> int:
    """How many are off by more than 4 eps of themselves, or not opposite another."""
    right = np.abs(places - true) <= 4 * np.finfo(places.dtype).eps * np.abs(true)
    return int(np.count_nonzero(~right | (places != -places[::-1])))


@SECTION.case(
    "focal length",
    symptom="The picture is black where the focal length is written in very small or very large numbers.",
    cause="The focal length multiplies offsets and distance alike; their squares leave the range of numbers, "
    "and beside a position they round.",
    remedy="It is divided out: a pinhole's picture does not depend on it.",
    expected="The same bytes for 1e-100 to 1e15; otherwise, and for 0 and less, an error that names "
    "focal_length.",
    source="geometry",
)
def focal_length() -> Outcome:
    """Every size that the scene language takes."""
    plain = view_of()
    x, y = centres(plain.width, plain.height)
    true = plain.directions(x, y)
    outcomes = [
        let_through(({"focal_length": f} for f in (0, -1, 1e-101, 1e30, math.nan)), "/camera/focal_length")
    ]
    for length in (1e-100, 1e-30, 1e-9, 0.035, 1e9, 1e15):
        directions = view_of(focal_length=length).directions(x, y)
        textbook = (
            off(plain, through_the_screen(plain, x, y, dtype, length), true)
            for dtype in (np.float64, np.float32)
        )
        outcomes.append(Outcome(x.size, differing(directions, true), *textbook))
    return total(outcomes)
