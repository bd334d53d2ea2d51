"""Tests of the kind `rays`: rounding is accepted, and a mistake is reported with an example row."""

from __future__ import annotations

import json
from dataclasses import asdict
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from renderer import compile_scene, load_scene, trace
from service.grading.rays.ray_agreement import UNIT, agreement, answers, relative
from service.grading.rays.ray_sources import RayList
from tests.service.grading.assignments import SCENE, Assignment, rays_test, scene

BALL: dict[str, Any] = scene(
    shapes=[{"type": "ellipsoid", "center": [0, 0, 0], "radius": 1, "material": "ball"}],
    lights=[{"type": "point", "position": [0, 0, 9], "color": [1, 1, 1]}],
)
FIELDS = ("t", "position", "normal", "uv", "shape", "visibility")


def rays_along_z(*offsets: float, distance: float = 4.0) -> RayList:
    """Rays along z towards the unit sphere, at these offsets from its centre."""
    origins = np.array([[x, 0.0, distance] for x in offsets])
    return RayList(origins, np.tile([0.0, 0.0, -1.0], (len(offsets), 1)))


def hits_of(rays: RayList, document: dict[str, Any] = BALL) -> dict[str, np.ndarray]:
    plan = compile_scene(load_scene(document))
    return {
        name: values.astype(np.float64) for name, values in asdict(trace(plan, *rays_arrays(rays))).items()
    }


def rays_arrays(rays: RayList) -> tuple[np.ndarray, np.ndarray]:
    return rays.origins, rays.directions


@pytest.fixture
def given_rays(assignment: Assignment) -> RayList:
    """Eight rays in a file beside the manifest, the last two of which miss; the scene is a sphere."""
    rays = rays_along_z(-0.6, -0.3, 0.0, 0.25, 0.5, 0.75, 1.5, 2.0)
    np.savez(assignment.references / "rays.npz", origins=rays.origins, directions=rays.directions)
    (assignment.references / "scene.json").write_text(json.dumps(BALL))
    return rays


def from_file(**changes: Any) -> dict[str, Any]:
    return rays_test(rays={"type": "file", "file": "rays.npz"}, **changes)


def test_right_hits_earn_all(assignment: Assignment, given_rays: RayList) -> None:
    assignment.hand_in("hits.npz", hits_of(given_rays))
    found = assignment.test(from_file(fields=FIELDS))
    assert (found.status, found.value, found.message) == ("passed", 1, "8 of 8 rays agree.")
    assert found.metrics["doubtful"] == 0


def test_the_share_of_agreeing_rays_earns_its_exact_share(
    assignment: Assignment, given_rays: RayList
) -> None:
    hits = hits_of(given_rays)
    hits["t"][:2] *= 2
    assignment.hand_in("hits.npz", hits)
    found = assignment.test(from_file(accept={"full": 1.0, "zero": 0.5}))
    # Two of eight rays are wrong: 3/4 is halfway between 1/2 and 1.
    assert Fraction(found.points) == 5
    assert "t in 2" in found.message
    assert "ellipsoid (shapes/0)" in found.message
    assert "In row 0, t is 6.4 and should be 3.2." in found.message


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda hits: hits["normal"].__imul__(-1), "point the wrong way"),
        (lambda hits: hits["normal"].__imul__(3), "length 1"),
        (lambda hits: hits["t"].__setitem__(slice(6), 9.0), "behind the right ones"),
        (lambda hits: hits["t"].__setitem__(slice(6), np.inf), "miss what they should hit"),
    ],
    ids=["turned", "long", "behind", "missed"],
)
def test_a_mistake_of_most_rays_is_named(
    assignment: Assignment, given_rays: RayList, spoil: Any, said: str
) -> None:
    hits = hits_of(given_rays)
    spoil(hits)
    assignment.hand_in("hits.npz", hits)
    assert said in assignment.test(from_file(fields=["t", "normal"])).message


def test_a_distance_instead_of_units_of_the_direction_is_named(assignment: Assignment) -> None:
    rays = RayList(rays_along_z(0.0, 0.5).origins, np.tile([0.0, 0.0, -2.0], (2, 1)))
    np.savez(assignment.references / "rays.npz", origins=rays.origins, directions=rays.directions)
    (assignment.references / "scene.json").write_text(json.dumps(BALL))
    hits = hits_of(rays)
    hits["t"] *= 2
    assignment.hand_in("hits.npz", hits)
    assert "length of the given direction" in assignment.test(from_file(fields=["t"])).message


def test_a_submitted_scene_is_traced(assignment: Assignment) -> None:
    scenes = {"submitted": {"type": "scene", "file": "scene.json"}}
    assert assignment.test(rays_test(**scenes)).status == "passed"
    assignment.hand_in("scene.json", scene(shapes=SCENE["shapes"][:1]))
    assert "ball (shapes/1)" in assignment.test(rays_test(**scenes)).message


def test_hits_of_the_same_scene_in_float32_agree_in_single_and_not_in_double(assignment: Assignment) -> None:
    rays = {"type": "ball", "center": [0, 1, 0], "distance": 8, "radius": 2, "count": 200, "seed": 3}
    cast = {"type": "scene", "file": "scene.json"}
    assert assignment.test(rays_test(rays=rays, submitted=cast)).status == "passed"
    from schemas.cameras import Camera
    from schemas.grading.manifests import BallRays
    from service.grading.folders import Folder
    from service.grading.rays.ray_sources import rays_of

    camera = Camera(position=(0, 0, 1), look_at=(0, 0, 0))
    list_ = rays_of(BallRays.model_validate(rays), camera, Folder(assignment.references, "reference"))
    rounded = {name: values.astype(np.float32) for name, values in hits_of(list_, SCENE).items()}
    assignment.hand_in("hits.npz", rounded)
    single = assignment.test(rays_test(rays=rays, accept={"full": 1.0}))
    assert single.status == "passed"
    double = assignment.test(rays_test(rays=rays, precision="double"))
    assert double.status == "failed"


@pytest.mark.parametrize("offset", [0.0, 0.3, -0.7, 0.9, 0.99])
def test_the_tolerance_covers_the_hit_of_a_shifted_ray_and_little_more(offset: float) -> None:
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


def test_a_ray_whose_hit_depends_on_rounding_is_excluded(assignment: Assignment) -> None:
    unit = relative("single", None)
    assert unit == 1024 * UNIT["single"]
    # Past the rim of the sphere by less than rounding shifts the ray, and by far more.
    rays = rays_along_z(1 - unit, 1 + unit, 0.5, 1.5)
    np.savez(assignment.references / "rays.npz", origins=rays.origins, directions=rays.directions)
    (assignment.references / "scene.json").write_text(json.dumps(BALL))
    hits = hits_of(rays)
    hits["t"][:2] = 77.0
    assignment.hand_in("hits.npz", hits)
    found = assignment.test(from_file(fields=["t"]))
    assert (found.status, found.metrics["doubtful"]) == ("passed", 2)
    assert found.message.startswith("2 of 2 rays agree; 2 are excluded")


def test_a_ray_that_should_miss_and_hits_is_wrong(assignment: Assignment, given_rays: RayList) -> None:
    hits = hits_of(given_rays)
    hits["t"][7], hits["shape"][7] = 3.0, 0
    assignment.hand_in("hits.npz", hits)
    assert assignment.test(from_file(fields=["t"])).value == 7 / 8
    assert assignment.test(from_file(fields=["shape"])).value == 7 / 8
    assert "background" in assignment.test(from_file(fields=["t"])).message


@pytest.mark.parametrize("number", [-1.0, 0.0, 99.0])
def test_a_miss_may_have_any_shape_where_its_distance_is_infinite(
    assignment: Assignment, given_rays: RayList, number: float
) -> None:
    hits = hits_of(given_rays)
    hits["shape"][6:] = number
    assignment.hand_in("hits.npz", hits)
    assert assignment.test(from_file(fields=["t", "shape"])).value == 1


def test_a_hit_without_a_distance_is_wrong_whatever_its_shape(
    assignment: Assignment, given_rays: RayList
) -> None:
    hits = hits_of(given_rays)
    hits["t"][0] = np.inf
    assignment.hand_in("hits.npz", hits)
    assert assignment.test(from_file(fields=["t", "shape"])).value == 7 / 8


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.uint32, np.uint64, np.int8])
def test_minus_one_may_be_stored_in_any_integer_type(
    assignment: Assignment, given_rays: RayList, kind: type[np.integer[Any]]
) -> None:
    shapes = hits_of(given_rays)["shape"].astype(np.int64).astype(kind)
    assignment.hand_in("hits.npz", {"shape": shapes})
    assert assignment.test(from_file(fields=["shape"])).value == 1


@pytest.mark.parametrize(
    ("samples", "off", "share"),
    [(1, 1.0, 0.0), (4, 1 / 4, 1.0), (4, 1 / 2, 0.0), (16, 1 / 16, 1.0), (16, 1 / 8, 0.0)],
)
def test_one_light_sample_may_differ_unless_it_is_the_only_one(
    assignment: Assignment, samples: int, off: float, share: float
) -> None:
    light = {"corner": [-1, -1, 9], "edges": [[2, 0, 0], [0, 2, 0]], "color": [1, 1, 1]}
    if samples == 1:
        light = {"type": "point", "position": [0, 0, 9], "color": [1, 1, 1]}
    sampling = {"light": {"pattern": "uniform", "samples": samples}}
    lit = BALL | {"lights": [{"type": "rectangle"} | light], "sampling": sampling}
    # Towards the centre of the sphere, where the whole light is visible.
    rays = rays_along_z(0.0, 0.01)
    np.savez(assignment.references / "rays.npz", origins=rays.origins, directions=rays.directions)
    (assignment.references / "scene.json").write_text(json.dumps(lit))
    hits = hits_of(rays, lit)
    assert (hits["visibility"] == 1).all()
    hits["visibility"] -= off
    assignment.hand_in("hits.npz", hits)
    assert assignment.test(from_file(fields=["visibility"])).value == share


@pytest.mark.parametrize(
    ("hits", "said"),
    [
        ({"t": np.zeros(7)}, r"(8,)"),
        ({"t": np.full(8, np.nan)}, "NaN in row 0"),
        ({"shape": np.zeros(8)}, "no array 't'"),
    ],
)
def test_hits_that_cannot_be_compared_are_not_gradable(
    assignment: Assignment, given_rays: RayList, hits: dict[str, np.ndarray], said: str
) -> None:
    assignment.hand_in("hits.npz", hits)
    found = assignment.test(from_file(fields=["t"]))
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
def test_invalid_rays_are_an_error_of_the_manifest(
    assignment: Assignment, rays: dict[str, np.ndarray]
) -> None:
    np.savez(assignment.references / "rays.npz", **rays)
    assignment.hand_in("hits.npz", {"t": np.zeros(2)})
    assert assignment.test(from_file()).status == "error"
