"""Hard cases: where a camera looks, and what is up in its picture."""

import math
import random
from collections.abc import Iterable
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

import schemas.cameras as language
from accuracy.hard_cases.cases import Outcome, Section, total
from accuracy.hard_cases.documents import Json, camera, scene
from accuracy.hard_cases.draws import direction, listed
from accuracy.hard_cases.exact_vectors import Triple, cross, dot, exact, minus, unit
from renderer.cameras import pinhole
from renderer.math.arrays import Floats
from schemas.errors import SceneError
from schemas.reading import read_scene

SECTION = Section("Cameras")

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
    view = pinhole.build(language.Camera.model_validate(written))
    return np.hstack((view.right, view.up, view.forward)).T


def exact_basis(look: Triple[Fraction], up: Triple[Fraction]) -> tuple[Floats, float]:
    """The same in rational numbers, and the sine of the angle between view and up."""
    right = cross(look, up)
    sine = math.sqrt(dot(right, right) / (dot(look, look) * dot(up, up)))
    return np.array([unit(right), unit(cross(right, look)), unit(look)]), sine


def textbook_bases(looks: Floats, ups: Floats, dtype: type[np.floating]) -> Floats:
    """Bases (N, 3, 3) of views (N, 3) by two products, each vector divided by the root of its square."""
    with np.errstate(all="ignore"):
        forward, up = _plain_unit(looks.astype(dtype)), ups.astype(dtype)
        right = _plain_unit(np.cross(forward, up))
        return np.stack((right, np.cross(right, forward), forward), axis=1).astype(np.float64)


def _plain_unit(v: Floats) -> Floats:
    return v / np.sqrt((v * v).sum(axis=1, keepdims=True))


def error(found: Floats, true: Floats, sine: float, dtype: type[np.floating]) -> float:
    """How far a basis is off, in shares of what is right: 4 eps from orthonormal, 5 eps / sine from true."""
    if not np.isfinite(found).all():
        return math.inf
    eps = float(np.finfo(dtype).eps)
    skew = np.abs(found @ found.T - np.eye(3)).max() / (4 * eps)
    off = np.abs(found - true).max() * sine / (5 * eps)
    return float(max(skew, off))


def tried(poses: list[Pose]) -> Outcome:
    """Ask the renderer and the textbook formula for the bases of cameras."""
    looks = [minus(exact(pose.look_at), exact(pose.position)) for pose in poses]
    upwards = [exact(pose.true_up or pose.up) for pose in poses]
    true = [exact_basis(look, up) for look, up in zip(looks, upwards, strict=True)]
    views, ups = np.array(looks, dtype=np.float64), np.array([pose.up for pose in poses])

    def errors(bases: Iterable[Floats], dtype: type[np.floating]) -> Floats:
        return np.array([error(basis, *t, dtype) for basis, t in zip(bases, true, strict=True)])

    shares = errors(map(basis_of, poses), np.float64)
    plain = [errors(textbook_bases(views, ups, dtype), dtype) for dtype in (np.float64, np.float32)]
    wrong, double, single = (int(np.count_nonzero(found > 1)) for found in (shares, *plain))
    return Outcome(len(poses), wrong, double, single, float(shares[shares <= 1].max(initial=0.0)))


def let_through(cameras: Iterable[Json], *names: str) -> Outcome:
    """Cameras that make no sense: wrong is which is accepted, or refused without these names."""
    told = [_refusal(camera(**changes)) for changes in cameras]
    return Outcome(len(told), sum(not text or any(name not in text for name in names) for text in told))


def _refusal(view: Json) -> str:
    try:
        read_scene(scene(camera=view))
    except SceneError as refused:
        return " ".join(f"{problem.pointer} {problem.detail}" for problem in refused.errors)
    return ""


def _whole(chosen: random.Random) -> list[float]:
    return [float(chosen.randint(-9, 9)) for _ in range(3)]


@SECTION.case(
    "up along the view",
    symptom="A camera that looks straight down or up gives a black picture, or one that is turned at random.",
    cause="The product of view and up is zero or rounding, and is divided by its own length.",
    remedy="Where the sine of the angle between them is at most 1e-9, the world axis with the smallest share "
    "of the view is up, and a warning says so.",
    expected="The basis with that axis up, each vector within 5 eps over the sine of its angle to the view; "
    "orthonormal to 4 eps.",
    source="geometry",
)
def up_along_the_view() -> Outcome:
    """Views in whole numbers with a multiple of themselves as up, forwards and backwards."""
    chosen = random.Random("along")
    poses: list[Pose] = []
    while len(poses) < CAMERAS:
        position, look = _whole(chosen), _whole(chosen)
        if any(look):
            least = int(np.argmin(np.abs(look)))
            axis = [float(i == least) for i in range(3)]
            up = listed(np.array(look) * chosen.choice([-1, 1]) * 10 ** chosen.uniform(-30, 12))
            poses.append(Pose(position, listed(np.add(position, look)), up, axis))
    return tried(poses)


@SECTION.case(
    "view nearly along up",
    symptom="The picture is turned or skewed by some degrees when the camera looks almost straight down.",
    cause="The product of view and up is short, so that its rounding error is large beside it, and what is "
    "formed from it is not perpendicular to the view.",
    remedy="The basis is formed in float64; right is made perpendicular to the view once more, and up is the "
    "product of the two.",
    expected="Orthonormal to 4 eps; each vector within 5 eps over the sine of the angle between view and up, "
    "which is from 1e-8 to 1e-2.",
    source="geometry, in rational numbers",
)
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


@SECTION.case(
    "length of up",
    symptom="The picture is black where up is written in very small or very large numbers.",
    cause="The square of its length is 0 or infinite.",
    remedy="Vectors are divided by their largest component before they are squared.",
    expected="The same bytes for every length from 2^-1000 to 2^49; the basis to 4 eps as above.",
    source="geometry, in rational numbers",
)
def length_of_up() -> Outcome:
    """Powers of two, which change no digit."""
    chosen, outcomes = random.Random("length"), []
    for exponent in (-1000, -600, -100, 49):
        pairs = []
        for _ in range(CAMERAS // 4):
            plain = Pose(_whole(chosen), direction(chosen), direction(chosen))
            pairs.append((plain, replace(plain, up=listed(np.ldexp(plain.up, exponent)))))
        changed = sum(basis_of(plain).tobytes() != basis_of(scaled).tobytes() for plain, scaled in pairs)
        outcome = tried([scaled for _, scaled in pairs])
        outcomes.append(replace(outcome, wrong=outcome.wrong + changed))
    return total(outcomes)


@SECTION.case(
    "a camera that looks at where it stands",
    symptom="A black picture, and no word about why.",
    cause="The view has no length; divided by it, every direction is NaN.",
    remedy="Equal places are refused by both names, and so is a lens that would be focused nearer than "
    "1e-100. Between other places, however near, the view is divided by its largest component first.",
    expected="An error that names position and look_at; the basis, as above, for places that are 5e-324 and "
    "more apart.",
    source="geometry, in rational numbers",
)
def looks_nowhere() -> Outcome:
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
    return total([let_through(nowhere, "'position'", "'look_at'"), tried(poses)])
