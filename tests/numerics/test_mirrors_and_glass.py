"""Mirrors and glass: Snell and Fresnel to 50 digits, the critical angle, edges of glass, facing mirrors."""

import itertools
from collections import Counter
from typing import Any

import numpy as np
import pytest

from renderer.integrator import local_radiance
from renderer.materials.optics import fresnel, reflected, refracted, transmitted_cosine
from renderer.math.arrays import dot, unit
from renderer.waves import Wave, camera_wave
from tests.documents import Json, phong, scene
from tests.documents import mesh as mesh_of
from tests.numerics.tracing import EPS, UP, mp, rays_of
from tests.pictures.parts import DOUBLE, plan_of
from tests.solids import outward, turned_box

Floats = np.ndarray
GLASS = phong([0, 0, 0], ambient=0, diffuse=0, transmission=1, ior=1.5, max_depth=64)


def waves(document: Json, origins: Floats, directions: Floats) -> list[Wave]:
    """All waves of rays (3, N), each after its ancestors."""
    plan = plan_of(document, DOUBLE)
    waiting, done = [camera_wave(rays_of(origins, directions))], []
    while waiting:
        wave = waiting.pop()
        _, points = local_radiance(plan, wave.rays, Counter())
        done.append(wave)
        for stage in plan.scattering:
            waiting.extend(stage.run(points, wave))
    return done


def through(document: Json, origins: Floats, directions: Floats) -> list[Wave]:
    """The rays that were only ever refracted: the camera's, those inside, those behind, and so on.

    For clear glass seen at angles where it reflects less than half.
    """
    chain = waves(document, origins, directions)
    ways = {0: chain[0]}
    for wave in chain[1:]:
        if wave.depth - 1 in ways and wave.weights.min() > 0.5:
            ways[wave.depth] = wave
    return [ways[depth] for depth in sorted(ways)]


def shares_of(cosine: Any, ratio: Any) -> tuple[Any, Any]:
    """Reflected share, and transmitted share by the transmitted amplitudes, of angles in 50 digits."""
    c, n = mp.mpf(cosine), mp.mpf(ratio)
    square = 1 - n**2 * (1 - c**2)
    if square <= 0:
        return mp.mpf(1), mp.mpf(0)
    inner = mp.sqrt(square)
    across, along = (n * c - inner) / (n * c + inner), (c - n * inner) / (c + n * inner)
    amplitudes = [2 * n * c / (n * c + inner), 2 * n * c / (c + n * inner)]
    return (across**2 + along**2) / 2, inner / (n * c) * (amplitudes[0] ** 2 + amplitudes[1] ** 2) / 2


def at_cosines(cosines: Floats) -> Floats:
    """Viewers (3, N) above the plane y = 0."""
    return np.stack((np.sqrt(1 - cosines * cosines), cosines, np.zeros(cosines.size)))


@pytest.mark.parametrize("ratio", [1 / 1.5, 1 / 1.33, 1.2, 1.0])
def test_reflected_and_transmitted_shares_sum_to_1(ratio: float) -> None:
    cosines = np.linspace(0.6, 1, 200)
    for cosine, share in zip(cosines, fresnel(at_cosines(cosines), UP, np.full(200, ratio)), strict=True):
        back, beyond = shares_of(float(cosine), ratio)
        assert abs(back + beyond - 1) < 1e-40
        assert abs(float(share) - back) <= 4 * EPS


def test_critical_angle_is_crossed_without_a_jump() -> None:
    """At cosines down to a rounding of the critical one, some cosine within 4 eps has the share."""
    steps = np.concatenate([side * 10.0 ** np.arange(-17, -0.9, 0.25) for side in (-1, 1)] + [[0.0]])
    cosines = np.sqrt(5) / 3 + steps
    viewers, ratio = at_cosines(cosines), np.full(cosines.size, 1.5)
    for cosine, share in zip(cosines, fresnel(viewers, UP, ratio), strict=True):
        steep, flat = (shares_of(min(max(float(cosine) + s * 4 * EPS, 0), 1), 1.5)[0] for s in (1, -1))
        assert min(steep, flat) - 4 * EPS <= share <= max(steep, flat) + 4 * EPS
    assert np.isfinite(refracted(viewers, UP, UP, ratio)).all()


def test_index_1_reflects_nothing_at_any_angle() -> None:
    cosines = np.append(10.0 ** -np.linspace(0, 12, 500), 0.0)
    assert not fresnel(at_cosines(cosines), UP, np.ones(501)).any()
    assert fresnel(at_cosines(cosines[-1:]), UP, np.full(1, 1.5)) == 1


def facing(count: int, seed: int) -> tuple[Floats, Floats]:
    """Viewers and normals on their side."""
    viewers, normals = (unit(np.random.default_rng(seed + k).normal(size=(3, count))) for k in (0, 1))
    return viewers, normals * np.where(dot(viewers, normals) < 0, -1.0, 1.0)


@pytest.mark.parametrize("ratio", [1 / 2.4, 1 / 1.5, 1.0, 1.3])
def test_refracted_direction_obeys_snell(ratio: float) -> None:
    """Each component within 16 eps of the direction in 50 digits, where the root is not near 0."""
    viewers, normals = facing(200, 3)
    steep = transmitted_cosine(dot(viewers, normals), np.full(200, ratio)) > 0.3
    viewers, normals = viewers[:, steep], normals[:, steep]
    found = refracted(viewers, normals, normals, np.full(viewers.shape[1], ratio))
    for viewer, normal, got in zip(viewers.T, normals.T, found.T, strict=True):
        v, n = (mp.matrix(w.tolist()) / mp.norm(mp.matrix(w.tolist())) for w in (viewer, normal))
        c = (v.T * n)[0]
        wanted = ratio * (c * n - v) - mp.sqrt(1 - mp.mpf(ratio) ** 2 * (1 - c**2)) * n
        assert max(abs(float(got[i]) - wanted[i]) for i in range(3)) <= 16 * EPS


def test_rays_stay_on_their_side_of_the_true_surface() -> None:
    viewers, normals = facing(5000, 7)
    bent, _ = facing(5000, 9)
    assert dot(reflected(viewers, bent, normals), normals).min() >= -4 * EPS
    assert dot(refracted(viewers, bent, normals, np.full(5000, 1 / 1.5)), normals).max() <= 4 * EPS
    straight = 2 * dot(bent, viewers) * bent - viewers
    assert np.count_nonzero(dot(straight, normals) < 0) > 500


@pytest.mark.parametrize("place", [0.0, 1e3, 1e6])
def test_edge_of_a_glass_cube_bends_by_one_of_its_faces(place: float) -> None:
    rng = np.random.default_rng(6)
    for _ in range(4):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
        center = place + rng.normal(size=3)
        targets = center + np.array([0.5, 0.5, 0]) @ axes + np.outer(rng.uniform(-0.4, 0.4, 75), axes[2])
        eye = center + [3 + rng.uniform(-1, 1), 3, rng.uniform(-1, 1)] @ axes
        ways = unit((targets - eye).T)
        cube = scene(*turned_box(center, axes, 1.0), materials={"plain": GLASS})
        # The first bounce is at one face, the second at the other.
        inside = [wave for wave in through(cube, np.tile(eye, (75, 1)).T, ways) if wave.depth <= 2][-1]
        bent = np.full((3, 75), np.nan)
        bent[:, inside.targets] = inside.rays.directions
        # What lies in a face shrinks by the index.
        off = [
            np.abs((bent - dot(bent, n) * n) - (ways - dot(ways, n) * n) / 1.5).max(axis=0)
            for n in axes[:2, :, None]
        ]
        assert (np.minimum(*off) <= 16 * EPS).all()


def seen_on_one_side(vertices: Floats, faces: Floats, eye: Floats, fewest: int) -> Floats:
    """Places (3, N) on edges, and on vertices if `fewest` is 1, whose triangles turn one side to an eye.

    The outline is left out: there a ray touches the solid without going through.
    """
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    front = ((eye - corners[:, 0]) * normals).sum(axis=1) > 0
    sides: dict[tuple[int, ...], set[bool]] = {}
    for face, turned in zip(faces.tolist(), front.tolist(), strict=True):
        for key in itertools.chain(
            itertools.combinations(sorted(face), 1), itertools.combinations(sorted(face), 2)
        ):
            sides.setdefault(key, set()).add(turned)
    keys = [key for key, both in sides.items() if len(both) == 1 and len(key) >= fewest]
    return np.stack([vertices[list(key)].mean(axis=0) for key in keys], axis=1)


@pytest.mark.parametrize("ior", [1.0, 1.5])
@pytest.mark.parametrize("place", [0.0, 1e6])
@pytest.mark.parametrize("rounds", [0, 2], ids=["few", "in a tree"])
def test_closed_mesh_of_glass_keeps_no_ray(ior: float, place: float, rounds: int) -> None:
    """Aimed at its very edges and vertices: whatever leaves the scene leaves it outside of the glass.

    Without vertices where rays are bent: at a sharp one a ray may enter and leave in one place.
    """
    vertices, faces = outward([place] * 3, 1, rounds)
    eye = np.array([3.1, 2.2, 1.7]) + place
    targets = seen_on_one_side(vertices, faces, eye, fewest=1 if ior == 1 else 2)
    glass = {"plain": {**GLASS, "ior": ior, "max_depth": 10}}
    done = waves(scene(mesh_of(vertices, faces), materials=glass), eye[:, None], targets - eye[:, None])
    away = np.concatenate(
        [w.rays.origin_surfaces.outside[np.isinf(w.rays.t)] for w in done if w.rays.origin_surfaces]
    )
    assert away.all()
    assert away.size >= targets.shape[1]
