"""Tests of the kind `rays`: rounding is accepted, and a mistake is reported with an example row."""

import json
from collections.abc import Callable
from dataclasses import asdict
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from renderer import compile_scene, load_scene, trace
from schemas.cameras import Camera
from schemas.grading.manifests import BallRays
from service.grading.folders import Folder
from service.grading.rays.ray_agreement import agreement, answers, relative
from service.grading.rays.ray_sources import RayList, rays_of
from tests.service.grading.assignments import SCENE, Assignment, rays_test, scene

BALL: dict[str, Any] = scene(
    shapes=[{"type": "ellipsoid", "center": [0, 0, 0], "radius": 1, "material": "ball"}],
    lights=[{"type": "point", "position": [0, 0, 9], "color": [1, 1, 1]}],
)
FIELDS = ("t", "position", "normal", "uv", "shape", "visibility")
Hits = dict[str, np.ndarray]


def rays_along_z(*offsets: float, distance: float = 4.0, length: float = 1.0) -> RayList:
    """Rays along z towards the unit sphere, at these offsets from its centre."""
    origins = np.array([[x, 0.0, distance] for x in offsets])
    return RayList(origins, np.tile([0.0, 0.0, -length], (len(offsets), 1)))


def hits_of(rays: RayList, document: dict[str, Any] = BALL) -> Hits:
    found = trace(compile_scene(load_scene(document)), rays.origins, rays.directions)
    return {name: values.astype(np.float64) for name, values in asdict(found).items()}


def give(assignment: Assignment, rays: RayList, document: dict[str, Any] = BALL) -> Hits:
    """Put rays and scene beside the manifest, and return the right hits."""
    np.savez(assignment.references / "rays.npz", origins=rays.origins, directions=rays.directions)
    (assignment.references / "scene.json").write_text(json.dumps(document))
    return hits_of(rays, document)


@pytest.fixture
def hits(assignment: Assignment) -> Hits:
    """Hits of eight rays, the last two of which miss."""
    return give(assignment, rays_along_z(-0.6, -0.3, 0.0, 0.25, 0.5, 0.75, 1.5, 2.0))


def graded(assignment: Assignment, hits: Hits, **changes: Any) -> Any:
    assignment.hand_in("hits.npz", hits)
    return assignment.test(rays_test(rays={"type": "file", "file": "rays.npz"}, **changes))


def test_right_hits_earn_all(assignment: Assignment, hits: Hits) -> None:
    found = graded(assignment, hits, fields=FIELDS)
    assert (found.status, found.value, found.metrics["doubtful"]) == ("passed", 1, 0)


def test_share_of_agreeing_rays_earns_its_exact_share(assignment: Assignment, hits: Hits) -> None:
    hits["t"][:2] *= 2
    found = graded(assignment, hits, accept={"full": 1.0, "zero": 0.5})
    # Two of eight rays are wrong: 3/4 is halfway between 1/2 and 1.
    assert Fraction(found.points) == 5
    assert "ellipsoid (shapes/0)" in found.message
    assert "In row 0, t is 6.4 and should be 3.2." in found.message


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda hits: hits["normal"].__imul__(-1), "point the wrong way"),
        (lambda hits: hits["normal"].__imul__(3), "length 1"),
        (lambda hits: hits["t"].__setitem__(slice(6), 9.0), "behind the right ones"),
        (lambda hits: hits["t"].__setitem__(slice(6), np.inf), "miss what they should hit"),
        (lambda hits: hits["t"].__setitem__(7, 3.0), "background"),
    ],
    ids=["turned", "long", "behind", "missed", "background"],
)
def test_mistake_of_rays_is_named(
    assignment: Assignment, hits: Hits, spoil: Callable[[Hits], Any], said: str
) -> None:
    spoil(hits)
    assert said in graded(assignment, hits, fields=["t", "normal"]).message


def test_distance_in_place_of_t_is_named(assignment: Assignment) -> None:
    hits = give(assignment, rays_along_z(0.0, 0.5, length=2.0))
    hits["t"] *= 2
    assert "length of the given direction" in graded(assignment, hits, fields=["t"]).message


def test_submitted_scene_is_traced(assignment: Assignment) -> None:
    scenes = {"submitted": {"type": "scene", "file": "scene.json"}}
    assert assignment.test(rays_test(**scenes)).status == "passed"
    assignment.hand_in("scene.json", scene(shapes=SCENE["shapes"][:1]))
    assert "ball (shapes/1)" in assignment.test(rays_test(**scenes)).message


@pytest.mark.parametrize(("precision", "status"), [("single", "passed"), ("double", "failed")])
def test_float32_hits_agree_in_single_and_not_in_double(
    assignment: Assignment, precision: str, status: str
) -> None:
    asked = {"type": "ball", "center": [0, 1, 0], "distance": 8, "radius": 2, "count": 200, "seed": 3}
    camera = Camera(position=(0, 0, 1), look_at=(0, 0, 0))
    rays = rays_of(BallRays.model_validate(asked), camera, Folder(assignment.references, "reference"))
    rounded = {name: values.astype(np.float32) for name, values in hits_of(rays, SCENE).items()}
    assignment.hand_in("hits.npz", rounded)
    assert assignment.test(rays_test(rays=asked, precision=precision)).status == status


@pytest.mark.parametrize("offset", [0.0, 0.3, -0.7, 0.9, 0.99])
def test_tolerance_covers_a_shifted_ray_and_little_more(offset: float) -> None:
    """On the unit sphere a ray at offset x hits z = sqrt(1 - x^2), and the normal equals the point."""
    share = relative("single", None)
    rays = rays_along_z(offset, distance=2.0)
    right = answers(compile_scene(load_scene(BALL)), rays, share, ("t", "normal"))
    assert not right.doubtful.any()
    z = np.sqrt(1 - offset**2)
    step = share * (np.hypot(offset, 2.0) + 2 - z)
    moved = np.array([offset + step, 0, np.sqrt(1 - (offset + step) ** 2)])
    submitted = {"t": np.array([2 - moved[2]]), "normal": moved[None]}
    assert all(rows.all() for rows in agreement(submitted, right).values())
    # t changes by x / z per sideways step; three times that, plus one step along the ray, is too far.
    far = step * (3 * abs(offset) / z + 1.5)
    assert not agreement({"t": np.array([2 - z + far])}, right)["t"].any()


def test_ray_that_depends_on_rounding_is_excluded(assignment: Assignment) -> None:
    step = relative("single", None)
    # Past the rim of the sphere by less than rounding shifts the ray, and by far more.
    hits = give(assignment, rays_along_z(1 - step, 1 + step, 0.5, 1.5))
    hits["t"][:2] = 77.0
    found = graded(assignment, hits, fields=["t"])
    assert (found.status, found.metrics["doubtful"]) == ("passed", 2)


@pytest.mark.parametrize(
    ("changes", "fields", "share"),
    [
        ({"t": (7, 3.0)}, ["t"], 7 / 8),
        ({"shape": (7, 0.0)}, ["shape"], 7 / 8),
        ({"t": (0, np.inf)}, ["t", "shape"], 7 / 8),
        *(({"shape": (slice(6, 8), number)}, ["t", "shape"], 1) for number in (-1.0, 0.0, 99.0)),
    ],
)
def test_hit_and_miss_are_told_apart(
    assignment: Assignment, hits: Hits, changes: dict[str, Any], fields: list[str], share: float
) -> None:
    for name, (rows, value) in changes.items():
        hits[name][rows] = value
    assert graded(assignment, hits, fields=fields).value == share


@pytest.mark.parametrize(
    ("samples", "off", "share"),
    [(1, 1.0, 0.0), (4, 1 / 4, 1.0), (4, 1 / 2, 0.0), (16, 1 / 16, 1.0), (16, 1 / 8, 0.0)],
)
def test_one_light_sample_may_differ_unless_it_is_the_only(
    assignment: Assignment, samples: int, off: float, share: float
) -> None:
    lamp = {"type": "rectangle", "corner": [-1, -1, 9], "edges": [[2, 0, 0], [0, 2, 0]], "color": [1, 1, 1]}
    sampling = {"light": {"pattern": "uniform", "samples": samples}}
    lit = BALL | {"lights": BALL["lights"] if samples == 1 else [lamp], "sampling": sampling}
    # Towards the centre of the sphere, where the whole light is visible.
    hits = give(assignment, rays_along_z(0.0, 0.01), lit)
    assert (hits["visibility"] == 1).all()
    hits["visibility"] -= off
    assert graded(assignment, hits, fields=["visibility"]).value == share


@pytest.mark.parametrize(
    ("wrong", "said"), [({"t": np.zeros(7)}, "(8,)"), ({"t": np.full(8, np.nan)}, "NaN in row 0")]
)
def test_unusable_hits_are_not_gradable(assignment: Assignment, hits: Hits, wrong: Hits, said: str) -> None:
    assert len(hits["t"]) == 8
    found = graded(assignment, wrong, fields=["t"])
    assert found.status == "not_gradable"
    assert said in found.message


@pytest.mark.parametrize(
    "rays",
    [
        {"origins": np.zeros((2, 3)), "directions": np.zeros((2, 3))},
        {"origins": np.zeros((2, 3)), "directions": np.ones((3, 3))},
        {"origins": np.full((2, 3), np.nan), "directions": np.ones((2, 3))},
        {"origins": np.zeros((2, 3))},
    ],
    ids=["no direction", "numbers", "nan", "missing"],
)
def test_invalid_rays_are_an_error_of_the_manifest(assignment: Assignment, rays: Hits) -> None:
    np.savez(assignment.references / "rays.npz", **rays)
    assert graded(assignment, {"t": np.zeros(2)}).status == "error"
