"""Hard cases A: from a camera and a pixel to a ray."""

import math
import random
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any

import mpmath
import numpy as np

import schemas.cameras as language
from accuracy.hard_cases.documents import Json, camera, sampled, scene
from accuracy.hard_cases.families import direction, listed
from accuracy.hard_cases.formulas import (
    between_points,
    plain_disk,
    plain_places,
    textbook_bases,
    through_the_screen,
)
from accuracy.hard_cases.harness import (
    Cases,
    Outcome,
    Outcomes,
    compiled,
    eps_of,
    exact,
    in_both,
    judged,
    problems_of,
    tally,
)
from accuracy.hard_cases.oracle import Triple, cross, minus, rational, unit
from accuracy.hard_cases.oracle import dot as exact_dot
from renderer.cameras import Pinhole, build_pinhole, disk
from renderer.math.arrays import Floats, dot

CAMERAS = 400


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a camera stands and looks, and what is up; `true_up` where another direction takes its place."""

    position: list[float]
    look_at: list[float]
    up: list[float]
    true_up: list[float] | None = None


def basis_of(pose: Pose) -> Floats:
    """Right, up and forward as rows (3, 3), as the renderer finds them."""
    written = {"position": pose.position, "look_at": pose.look_at, "up": pose.up}
    view = build_pinhole(language.Camera.model_validate(written))
    return np.hstack((view.right, view.up, view.forward)).T


def exact_basis(look: Triple[Fraction], up: Triple[Fraction]) -> tuple[Floats, float]:
    """The same in rational numbers, and the sine of the angle between view and up."""
    right = cross(look, up)
    sine = math.sqrt(exact_dot(right, right) / (exact_dot(look, look) * exact_dot(up, up)))
    return np.array([unit(right), unit(cross(right, look)), unit(look)]), sine


def error(found: Floats, true: Floats, sine: float, dtype: type[np.floating]) -> float:
    """How far a basis is off, in shares of what is right: 4 eps from orthonormal, 5 eps / sine from true."""
    if not np.isfinite(found).all():
        return math.inf
    eps = eps_of(dtype)
    skew = np.abs(found @ found.T - np.eye(3)).max() / (4 * eps)
    off = np.abs(found - true).max() * sine / (5 * eps)
    return float(max(skew, off))


def tried(poses: list[Pose]) -> Outcome:
    """Ask the renderer and the textbook formula for the bases of cameras."""
    looks = [minus(rational(pose.look_at), rational(pose.position)) for pose in poses]
    true = [
        exact_basis(look, rational(pose.true_up or pose.up)) for look, pose in zip(looks, poses, strict=True)
    ]
    views, ups = np.array(looks, dtype=np.float64), np.array([pose.up for pose in poses])

    def errors(bases: Iterable[Floats], dtype: type[np.floating]) -> Floats:
        return np.array([error(basis, *t, dtype) for basis, t in zip(bases, true, strict=True)])

    plain = in_both(lambda dtype: errors(textbook_bases(views.astype(dtype), ups.astype(dtype)), dtype))
    return judged(errors(map(basis_of, poses), np.float64), *plain)


def let_through(cameras: Iterable[Json], *names: str) -> Outcome:
    """Cameras that make no sense: wrong is which is accepted, or refused without these names."""
    refusals = [
        " ".join(
            f"{problem.pointer} {problem.detail}" for problem in problems_of(scene(camera=camera(**each)))
        )
        for each in cameras
    ]
    return Outcome(len(refusals), sum(not all(name in text for name in names) for text in refusals))


def _whole(chosen: random.Random) -> list[float]:
    return [float(chosen.randint(-9, 9)) for _ in range(3)]


def up_along_the_view() -> Outcome:
    """Views in whole numbers with a multiple of themselves as up, forwards and backwards."""
    chosen = random.Random("along")
    poses: list[Pose] = []
    while len(poses) < CAMERAS:
        position, look = (
            _whole(chosen),
            _whole(chosen),
        )
        if any(look):
            least = int(np.argmin(np.abs(look)))
            axis = [float(i == least) for i in range(3)]
            up = listed(np.array(look) * chosen.choice([-1, 1]) * 10 ** chosen.uniform(-30, 12))
            poses.append(Pose(position, listed(np.add(position, look)), up, axis))
    return tried(poses)


def nearly_along_up() -> Outcome:
    """Angles from 1e-8 to 1e-2, in any direction and from any place."""
    chosen, poses = random.Random("nearly"), []
    for _ in range(CAMERAS):
        up, aside = np.array(direction(chosen)), np.array(direction(chosen))
        tilt = 10 ** chosen.uniform(-8, -2) / float(np.linalg.norm(np.cross(up, aside)))
        position = np.array(_whole(chosen))
        look_at = position + chosen.uniform(1, 100) * (chosen.choice([-1, 1]) * up + tilt * aside)
        poses.append(Pose(listed(position), listed(look_at), listed(up)))
    return tried(poses)


def length_of_up() -> Iterator[Outcomes]:
    """Powers of two, which change no digit."""
    chosen = random.Random("length")
    for exponent in (-1000, -600, -100, 49):
        pairs = []
        for _ in range(CAMERAS // 4):
            plain = Pose(_whole(chosen), direction(chosen), direction(chosen))
            pairs.append((plain, replace(plain, up=listed(np.ldexp(plain.up, exponent)))))
        changed = sum(basis_of(plain).tobytes() != basis_of(scaled).tobytes() for plain, scaled in pairs)
        outcome = tried([scaled for _, scaled in pairs])
        yield replace(outcome, wrong=outcome.wrong + changed)


def looks_nowhere() -> Outcomes:
    """The same place, the same number written otherwise, or after rounding; places some 5e-324 apart."""
    nowhere: list[Json] = [
        {"position": [1, 2, 3], "look_at": [1, 2, 3]},
        {"position": [0, 2, 3], "look_at": [-0.0, 2, 3]},
        {"position": [1e15, 0, 0], "look_at": [1e15 + 0.01, 0, 0]},
        {"position": [0, 0, 0], "look_at": [0, 0, 1e-320], "lens_radius": 1},
    ]
    chosen = random.Random("near")
    poses: list[Pose] = []
    while len(poses) < CAMERAS // 4:
        look = [chosen.randint(-2000, 2000) * 5e-324 for _ in range(3)]
        if any(look):
            poses.append(Pose([0.0, 0.0, 0.0], look, direction(chosen)))
    return [let_through(nowhere, "'position'", "'look_at'"), tried(poses)]


VISIBLE = 1e-3
"""Pixels by which a ray of a formula may be off: no one sees it."""


def view_of(**changes: Any) -> Pinhole:
    """The camera of a plan."""
    sampling = sampled(samples=16, pattern="random")
    written = scene(camera=camera(**changes), sampling=sampling)
    return compiled(written).camera


def centres(columns: int, rows: int) -> tuple[Floats, Floats]:
    """Raster positions of the pixels in the upper left of a picture, (N,) and (N,)."""
    y, x = np.indices((rows, columns), dtype=np.float64).reshape(2, -1) + 0.5
    return x, y


def off(view: Pinhole, found: Floats, true: Floats) -> int:
    """Directions that miss the true ones on the screen by more than `VISIBLE` pixels, or are none."""
    pixel = 2 * view.half_height / view.height
    with np.errstate(all="ignore"):
        places, expected = (d / dot(d, view.forward) for d in (found.astype(np.float64), true))
        right = np.abs(places - expected).max(axis=0) <= VISIBLE * pixel
    return tally(~right)


def ends_of_the_field_of_view() -> Iterator[Outcomes]:
    """640 columns from a turned camera."""
    bad = ({"vertical_fov": fov} for fov in (0, -10, 180, 200, math.nan, math.inf))
    yield let_through(bad, "/camera/vertical_fov")
    for fov in (1e-3, 179.99):
        view = view_of(position=[3, 1, 4], look_at=[1, 5, 9], vertical_fov=fov, width=640, height=640)
        x, y = centres(640, 10)
        plain = in_both(partial(through_the_screen, view, x, y))
        missing = [
            x.size - len(np.unique(directions[:, np.isfinite(directions).all(axis=0)], axis=1).T)
            for directions in (view.directions(x, y), *plain)
        ]
        yield Outcome(x.size, *missing)


Formula = Callable[[Pinhole, Floats, Floats, Any], Floats]
"""A camera, raster positions x and y (N,) and a dtype, to directions (3, N)."""


def moved_away(place: list[float], formula: Formula, **lens: float) -> Outcome:
    """Directions of a camera at a place that are not those at the origin."""
    sizes: Json = {"vertical_fov": 60, "width": 640, "height": 480, **lens}
    here = view_of(position=[0, 0, 0], look_at=[4, -2, -10], **sizes)
    there = view_of(position=place, look_at=np.add(place, [4, -2, -10]).tolist(), **sizes)
    x, y = centres(640, 3)
    pixels = np.arange(x.size)
    true, found = (view.rays(x, y, pixels, pixels % 16)[1] for view in (here, there))
    plain = in_both(lambda dtype: off(here, formula(there, x, y, dtype), true))
    return Outcome(x.size, tally((found != true).any(axis=0)), *plain)


SIZES = ((1920, 1), (1, 1080), (1, 1), (3, 2), (2, 3), (8192, 1))


def thin_pictures() -> Iterator[Outcomes]:
    """Places of all columns and rows."""
    for width, height in SIZES:
        view = view_of(vertical_fov=50, width=width, height=height)
        across, down = view.screen(*(np.arange(n, dtype=np.float64) + 0.5 for n in (width, height)))
        for size, found, aspect in ((width, across, Fraction(width, height)), (height, -down, Fraction(1))):
            true, side = exact_places(size, aspect)
            plain = in_both(partial(plain_places, size, side))
            yield Outcome(size, *(misplaced(places, true) for places in (found, *plain)))


@exact
def exact_places(size: int, aspect: Fraction) -> tuple[Floats, float]:
    """Pixel centres on a screen as wide as a view of 50 degrees times its aspect, and half its width."""
    side = mpmath.tan(mpmath.radians(25)) * aspect.numerator / aspect.denominator
    return np.array([float(side * (2 * i + 1 - size) / size) for i in range(size)]), float(side)


def misplaced(places: Floats, true: Floats) -> int:
    """How many are off by more than 4 eps of themselves, or not opposite another."""
    right = np.abs(places - true) <= 4 * np.finfo(places.dtype).eps * np.abs(true)
    return tally(~right | (places != -places[::-1]))


def focal_length() -> Iterator[Outcomes]:
    """Every size that the scene language takes."""
    plain = view_of()
    x, y = centres(plain.width, plain.height)
    true = plain.directions(x, y)
    bad = ({"focal_length": f} for f in (0, -1, 1e-101, 1e30, math.nan))
    yield let_through(bad, "/camera/focal_length")
    for length in (1e-100, 1e-30, 1e-9, 0.035, 1e9, 1e15):
        found = view_of(focal_length=length).directions(x, y)
        textbook = in_both(partial(through_the_screen, plain, x, y, focal_length=length))
        wrong = tally((found != true).any(axis=0))
        yield Outcome(x.size, wrong, *(off(plain, each, true) for each in textbook))


def middle_of_the_lens() -> Outcome:
    """Places on the axes, on the diagonals, at the corners and in the middle."""
    steps = np.arange(33) / 32
    a, b = (c.ravel() for c in np.meshgrid(steps, steps))
    true = np.array([on_the_disk(2 * p - 1, 2 * q - 1) for p, q in zip(a, b, strict=True)]).T

    def errors(places: Any, dtype: type[np.floating]) -> Floats:
        return np.abs(np.array(places) - true).max(axis=0) / (4 * eps_of(dtype))

    plain = in_both(lambda dtype: errors(plain_disk(*(2 * np.stack((a, b)) - 1).astype(dtype)), dtype))
    return judged(errors(disk(a, b), np.float64), *plain)


@exact
def on_the_disk(x: float, y: float) -> tuple[float, float]:
    """The map to 50 digits."""
    radius, other = (x, y) if abs(x) > abs(y) else (y, x)
    turn = mpmath.pi / 4 * mpmath.mpf(other) / radius if radius else mpmath.mpf(0)
    near, far = float(radius * mpmath.cos(turn)), float(radius * mpmath.sin(turn))
    return (near, far) if abs(x) > abs(y) else (far, near)


CASES: Cases = {
    "A1: up along the view": up_along_the_view,
    "A2: view nearly along up": nearly_along_up,
    "A1: length of up": length_of_up,
    "A3: a camera that looks at where it stands": looks_nowhere,
    "A4: field of view at its ends": ends_of_the_field_of_view,
    "A5: a camera far from the origin": lambda: (
        moved_away(place, through_the_screen)
        for place in ([1e7] * 3, [-(2.0**40), 3e12, 1e11], [9e14, -8e14, 7e14])
    ),
    "A6: pictures of one row, one column, one pixel": thin_pictures,
    "A7: focal length": focal_length,
    "A8: a lens far from the origin": lambda: (
        moved_away(place, between_points, lens_radius=0.5) for place in ([1e7] * 3, [9e14, -8e14, 7e14])
    ),
    "A9: the middle of the lens": middle_of_the_lens,
}
