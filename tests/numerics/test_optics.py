"""Reflection and refraction against Snell and Fresnel in exact arithmetic."""

from collections import Counter

import mpmath
import numpy as np
import pytest

from accuracy.hard_cases.documents import Json, bulb, phong, rectangle, scene, sphere, triangle
from accuracy.hard_cases.harness import exact
from accuracy.hard_cases.solids import outward
from accuracy.hard_cases.trees_and_bounces.bounces import GLASS, through, waves
from renderer.integrator import local_radiance
from renderer.interaction import Rays
from renderer.materials.optics import fresnel, reflected, refracted, transmitted_cosine
from renderer.math.arrays import dot, unit
from tests.pictures.parts import DOUBLE, plan_of

EPS = float(np.finfo(np.float64).eps)
UP = np.array([[0.0], [1.0], [0.0]])


def vectors(count: int, seed: int) -> np.ndarray:
    return unit(np.random.default_rng(seed).normal(size=(3, count)))


def facing(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Viewers and normals on their side."""
    viewers, normals = vectors(count, seed), vectors(count, seed + 1)
    return viewers, normals * np.where(dot(viewers, normals) < 0, -1.0, 1.0)


def shares_of(cosine: float, ratio: float) -> tuple[mpmath.mpf, mpmath.mpf]:
    """Reflected share, and transmitted share by the transmitted amplitudes, of angles in 50 digits."""
    c, n = mpmath.mpf(cosine), mpmath.mpf(ratio)
    inner = mpmath.sqrt(1 - n**2 * (1 - c**2))
    across, along = (n * c - inner) / (n * c + inner), (c - n * inner) / (c + n * inner)
    through = [2 * n * c / (n * c + inner), 2 * n * c / (c + n * inner)]
    flux = inner / (n * c)
    return (across**2 + along**2) / 2, flux * (through[0] ** 2 + through[1] ** 2) / 2


@pytest.mark.parametrize("ratio", [1 / 1.5, 1 / 1.33, 1.2, 1.0])
@exact
def test_reflected_and_transmitted_shares_sum_to_1_as_fresnel_says(ratio: float) -> None:
    viewers = np.stack((np.sqrt(1 - np.linspace(0.6, 1, 200) ** 2), np.linspace(0.6, 1, 200), np.zeros(200)))
    shares = fresnel(viewers, UP, np.full(200, ratio))
    for cosine, share in zip(viewers[1], shares, strict=True):
        back, through = shares_of(cosine, ratio)
        assert abs(back + through - 1) < 1e-40
        assert abs(mpmath.mpf(share) - back) <= 4 * EPS
        assert abs(mpmath.mpf(share) + through - 1) <= 4 * EPS


def test_at_right_angles_glass_reflects_4_percent() -> None:
    assert fresnel(UP, UP, np.array([1 / 1.5])) == pytest.approx(0.04, rel=4 * EPS)


@pytest.mark.parametrize(("ratio", "share"), [(1.0, 0.0), (1.5, 1.0), (1 / 1.5, 1.0)])
def test_along_the_surface_all_is_reflected_but_by_index_1(ratio: float, share: float) -> None:
    viewers = np.array([[1.0], [0.0], [0.0]])
    assert fresnel(viewers, UP, np.array([ratio])) == share


@pytest.mark.parametrize("ratio", [1 / 2.4, 1 / 1.5, 1.0, 1.3])
@exact
def test_refracted_directions_obey_snell_in_the_plane_of_incidence(ratio: float) -> None:
    """Each component within 16 eps of the direction in 50 digits, where the root is not near 0."""
    viewers, normals = facing(200, 3)
    steep = transmitted_cosine(dot(viewers, normals), np.full(200, ratio)) > 0.3
    viewers, normals = viewers[:, steep], normals[:, steep]
    through = refracted(viewers, normals, normals, np.full(viewers.shape[1], ratio))
    for viewer, normal, got in zip(viewers.T, normals.T, through.T, strict=True):
        v, n = (mpmath.matrix(w.tolist()) for w in (viewer, normal))
        v, n = v / mpmath.norm(v), n / mpmath.norm(n)
        c = (v.T * n)[0]
        wanted = ratio * (c * n - v) - mpmath.sqrt(1 - mpmath.mpf(ratio) ** 2 * (1 - c**2)) * n
        assert max(abs(mpmath.mpf(got[i]) - wanted[i]) for i in range(3)) <= 16 * EPS


def test_rays_stay_on_their_side_of_the_true_surface() -> None:
    viewers, normals = facing(5000, 7)
    bent = vectors(5000, 9)
    back = dot(reflected(viewers, bent, normals), normals)
    through = dot(refracted(viewers, bent, normals, np.full(5000, 1 / 1.5)), normals)
    assert back.min() >= -4 * EPS
    assert through.max() <= 4 * EPS
    straight = 2 * dot(bent, viewers) * bent - viewers
    assert np.count_nonzero(dot(straight, normals) < 0) > 500


def test_a_slab_moves_rays_sideways_and_keeps_their_direction() -> None:
    """The upper face enters, the lower one, whose front is below, leaves: both fronts are outside."""
    slab = [rectangle([-9, 0, -9], [0, 0, 18], [18, 0, 0]), rectangle([-9, -1, -9], [18, 0, 0], [0, 0, 18])]
    angles = np.linspace(0.05, 1.3, 30)
    directions = np.stack((np.sin(angles), -np.cos(angles), np.zeros(30)))
    chain = through(scene(*slab, materials={"plain": GLASS}), np.array([[0.0], [1.0], [0.0]]), directions)
    inside, behind = chain[1], chain[2]
    assert behind.targets.size >= 25
    assert np.abs(behind.rays.directions - directions[:, behind.targets]).max() <= 32 * EPS
    for target, start in zip(behind.targets, behind.rays.origins.T, strict=True):
        wanted = np.tan(angles[target]) + np.tan(np.arcsin(np.sin(angles[target]) / 1.5))
        assert start[0] == pytest.approx(wanted, rel=1e-13)
    assert inside.rays.t.size >= behind.targets.size


def folded() -> list[Json]:
    """A mirror of two coplanar triangles and a rectangle that touches them at a right angle."""
    return [
        triangle([0, 0, 0], [0, 0, 3], [3, 0, 0]),
        triangle([3, 0, 3], [3, 0, 0], [0, 0, 3]),
        rectangle([0, 0, 0], [3, 0, 0], [0, 3, 0]),
    ]


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e6])
def test_no_ray_slips_through_the_fold_of_two_mirrors(offset: float) -> None:
    """Aimed at the very line where mirrors meet, and at the seam of two triangles: nothing gets below."""
    move = np.array([[offset], [offset], [offset]])
    shapes = [moved(shape, offset) for shape in folded()]
    mirror = {"plain": phong([0, 0, 0], ambient=0, diffuse=0, mirror=1, max_depth=64)}
    x = np.random.default_rng(4).uniform(0.1, 2.9, 500)
    seam = np.stack((x, np.zeros(500), 3 - x))
    fold = np.stack((x, np.zeros(500), np.zeros(500)))
    origins = np.array([[1.3], [1.1], [1.7]]) + move
    for places in (seam, fold):
        done = waves(scene(*shapes, materials=mirror), origins, places + move - origins)
        ending = [wave for wave in done if np.isinf(wave.rays.t).any()]
        assert sum(int(np.isinf(wave.rays.t).sum()) for wave in ending) == 500
        for wave in ending:
            lost = wave.rays.directions[:, np.isinf(wave.rays.t)]
            assert lost[1].min() > 0
        assert max(wave.depth for wave in done) <= 2


def moved(shape: Json, offset: float) -> Json:
    if "vertices" in shape:
        return {**shape, "vertices": [[x + offset for x in vertex] for vertex in shape["vertices"]]}
    return {**shape, "corner": [x + offset for x in shape["corner"]]}


def within_one_turn(vertices: np.ndarray, faces: np.ndarray, eye: np.ndarray, fewest: int) -> np.ndarray:
    """Places (3, N) on edges, and on vertices if `fewest` is 1, whose triangles turn one side to an eye.

    The outline is left out: there a ray touches the solid without going through.
    """
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    front = ((eye - corners[:, 0]) * normals).sum(axis=1) > 0
    sides: dict[tuple[int, ...], set[bool]] = {}
    for face, turned in zip(faces.tolist(), front.tolist(), strict=True):
        for i in range(3):
            sides.setdefault((face[i],), set()).add(turned)
            sides.setdefault(tuple(sorted((face[i], face[i - 1]))), set()).add(turned)
    return np.stack(
        [
            vertices[list(key)].mean(axis=0)
            for key, both in sides.items()
            if len(both) == 1 and len(key) >= fewest
        ],
        axis=1,
    )


@pytest.mark.parametrize("ior", [1.0, 1.5])
@pytest.mark.parametrize("place", [0.0, 1e3, 1e6])
@pytest.mark.parametrize("rounds", [0, 1, 2], ids=["few", "some", "in a tree"])
def test_no_ray_stays_in_a_closed_mesh_of_glass(ior: float, place: float, rounds: int) -> None:
    """Aimed at its very edges and vertices: whatever leaves the scene leaves it outside of the glass.

    Without vertices where rays are bent: at a sharp one a ray may enter and leave in one place.
    """
    vertices, faces = outward([place] * 3, 1, rounds)
    eye = np.array([3.1, 2.2, 1.7]) + place
    targets = within_one_turn(vertices, faces, eye, fewest=1 if ior == 1 else 2)
    shape = {
        "type": "mesh",
        "vertices": vertices.tolist(),
        "triangles": faces.tolist(),
        "material": "plain",
    }
    glass = {"plain": {**GLASS, "ior": ior, "max_depth": 12}}
    done = waves(scene(shape, materials=glass), eye[:, None], targets - eye[:, None])
    away = [
        wave.rays.origin_surfaces.outside[np.isinf(wave.rays.t)] for wave in done if wave.rays.origin_surfaces
    ]
    assert np.concatenate(away).all()
    assert np.concatenate(away).size >= targets.shape[1]


def test_a_lit_point_behind_glass_is_in_its_shadow() -> None:
    """Every shape blocks light, glass too, though the point is seen through it."""
    floor = {**phong([1, 1, 1], ambient=0, diffuse=1)}
    document = scene(
        rectangle([-5, 0, -5], [0, 0, 10], [10, 0, 0], material="floor"),
        sphere([0, 1.5, 0], 1),
        lights=[bulb([0, 9, 0])],
        materials={"plain": GLASS, "floor": floor},
    )
    plan = plan_of(document, DOUBLE)
    down = np.array([[0.0], [-1.0], [0.0]])
    seen, points = local_radiance(
        plan, Rays(np.array([[0.1], [0.3], [0.0]]), down, np.zeros(1, int), np.zeros(1, int)), Counter()
    )
    assert points.count == 1
    assert seen.max() == 0
