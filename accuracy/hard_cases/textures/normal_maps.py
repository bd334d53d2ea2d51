"""Hard cases G: normal maps, and the frames they stand in."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from accuracy.hard_cases.documents import Json, rectangle, triangle
from accuracy.hard_cases.harness import (
    EPS,
    Cases,
    Outcome,
    Outcomes,
    eps_of,
    in_both,
    judged,
    points,
    tally,
)
from accuracy.hard_cases.textures.lookups import UP, mapped
from renderer.materials.maps import FLAT
from renderer.math.arrays import Floats, cross, dot, unit
from renderer.shapes.frames import frame_of_normals


def texels() -> NDArray[Any]:
    """Normal-map texels (1, N, 3): all greys near the middle, flat, inward, black ones, and random ones."""
    near = np.stack(np.meshgrid(*[np.arange(125, 132)] * 3), axis=-1).reshape(-1, 3)
    special = [(128, 128, 255), (0, 0, 0), (128, 128, 0), (255, 0, 0), (0, 0, 255), (255, 255, 255)]
    return np.vstack((near, special, np.random.default_rng(2).integers(0, 256, (700, 3))))[None]


def silent_texels() -> Iterator[Outcomes]:
    """All texels from above and aslant; then places half-way between 127 and 128."""
    codes = texels()
    floor = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
    plan = mapped(floor, codes=codes, normal_map="map")
    count = codes.shape[1]
    targets = np.stack((np.zeros(count), np.zeros(count), -4 + 8 * (np.arange(count) + 0.5) / count))
    decoded = (2 * (codes[0].T / np.float32(255)).astype(np.float32).astype(np.float64) - 1)[[1, 2, 0]]
    flat = (codes[0] == (128, 128, 255)).all(axis=1)
    yield _grey_between(floor)
    for viewer in (np.array([[0.1], [0.9], [-0.2]]), np.array([[0.7], [0.3], [0.4]])):
        viewers = np.repeat(unit(viewer), count, axis=1)
        true, sines = _formula(decoded, viewers)
        normals = points(plan, targets + viewers, -viewers).shading_normals
        off = np.abs(normals - true).max(axis=0) / (16 * EPS / sines)
        off[flat & (normals[1] < np.cos(np.radians(0.4)))] = np.inf
        plain, _ = _formula(decoded, viewers, least=0.0)
        yield judged(off, np.abs(plain - true).max(axis=0) / (16 * EPS / sines))


def _formula(decoded: Floats, viewers: Floats, least: float = FLAT) -> tuple[Floats, Floats]:
    """Normals (3, N) on a floor and the sines of their angles to the viewers, 1 where they are not bent."""
    normals = np.where(dot(decoded, decoded) < least, UP, unit(decoded))
    cosines = dot(normals, viewers)
    sines = np.where(cosines < 0, np.sqrt((1 - cosines) * (1 + cosines)), 1.0)
    return np.where(cosines < 0, unit(normals - viewers * cosines), normals), sines


def _grey_between(floor: Json) -> Outcome:
    codes = np.where(np.arange(40) % 2 == 0, 127, 128)[None, :, None].repeat(3, axis=2)
    plan = mapped(floor, codes=codes, filter_="bilinear", normal_map="map")
    targets = np.stack((np.zeros(39), np.zeros(39), -4 + 8 * np.arange(1, 40) / 40))
    normals = points(plan, targets + UP, np.repeat(-UP, 39, axis=1)).shading_normals
    return Outcome(39, tally((normals != UP).any(axis=0)))


def flat_map() -> Iterator[Outcomes]:
    """Triangles whose normals tilt away from the viewer, with a grey map and without."""
    rng = np.random.default_rng(3)
    share = (np.arange(100) + 0.5) / 100
    targets = np.stack((-4 + 8 * share, np.zeros(100), np.full(100, -4 + 2.0**-20)))
    for _ in range(10):
        last = unit(np.array([[rng.normal()], [-0.6], [rng.normal()]]))
        viewers = np.repeat(unit(np.array([[rng.normal()], [0.4], [rng.normal()]])), 100, axis=1)
        smooth = triangle([-4, 0, -4], [-4, 0, 4], [4, 0, -4], normals=[[0, 1, 0], [0, 1, 0], last[:, 0]])
        grey = np.full((1, 1, 3), 128)
        bare, carved = (
            points(mapped(smooth, codes=grey, **more), targets + viewers, -viewers).shading_normals
            for more in ({}, {"normal_map": "map"})
        )
        raw = unit((1 - share) * UP + share * last)
        bent, sines = _formula(raw, viewers)
        off = np.abs(bare - carved).max(axis=0) / (8 * EPS / sines)
        allowed = 8 * EPS / sines
        yield judged(off, np.abs(raw - bent).max(axis=0) / allowed)


def frames() -> Outcome:
    """Normals 1e-7 to 0.1 from straight down, straight down itself, and the one that pbrt tests."""
    rng = np.random.default_rng(4)
    tilt, turn = 10 ** rng.uniform(-7, -1, 1000), rng.uniform(0, 2 * np.pi, 1000)
    down = np.stack((np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), -np.cos(tilt)))
    known = np.array([[0.0, -0.0, 0.00038527316], [0.0, 0.0, 0.00038460016], [-1.0, -1.0, -0.99999988079]])
    normals = np.hstack((down, unit(known)))

    def off(normals: Any, tangents: Any) -> Floats:
        n, t = normals.astype(np.float64), tangents.astype(np.float64)
        allowed = 8 * eps_of(normals.dtype)
        return np.maximum(np.abs(dot(t, n)), np.abs(dot(t, t) - 1)) / allowed

    plain = in_both(lambda dtype: off(normals.astype(dtype), plain_tangents(normals.astype(dtype))))
    return judged(off(normals, frame_of_normals(normals)), *plain)


def plain_tangents(normals: Any) -> Any:
    """Frisvad's form of 2012."""
    x, y, z = normals
    a = 1 / (1 + z)
    return np.stack((1 - x * x * a, -x * y * a, -x))


def silent_tangents() -> Iterator[Outcomes]:
    """Smooth normals within 1e-7 of the tangent or on it, and texture coordinates on a point or a line."""
    rng = np.random.default_rng(5)
    texel = np.array([200, 150, 225])
    decoded = 2 * (texel / 255).astype(np.float32).astype(np.float64) - 1
    height = decoded[2] / np.sqrt(decoded @ decoded)
    for number in range(150):
        aside = unit(np.array([[rng.normal()], [abs(rng.normal())], [0.0]]))
        smooth = unit(np.array([[0.0], [0.0], [1.0]]) + (0.0, 10 ** rng.uniform(-16, -7))[number % 2] * aside)
        uvs = ([[0, 0], [1, 0], [0, 1]], [[0.5, 0.5]] * 3, [[0, 0], [1, 1], [2, 2]])[number // 2 % 3]
        shape = triangle([-1, 0, -1], [-1, 0, 1], [1, 0, -1], uvs=uvs, normals=[smooth[:, 0]] * 3)
        viewer = unit(smooth + 0.3 * UP)
        plan = mapped(shape, codes=texel[None, None], normal_map="map")
        targets = np.stack((rng.uniform(-0.9, 0, 8), np.zeros(8), rng.uniform(-0.9, 0, 8)))
        normal = points(plan, targets + viewer, np.repeat(-viewer, 8, axis=1)).shading_normals
        off = np.maximum(np.abs(dot(normal, smooth) - height), np.abs(dot(normal, normal) - 1)) / (16 * EPS)
        yield judged(off, np.full(8, _plain_frame(smooth, np.array(uvs, dtype=np.float64))))


def _plain_frame(smooth: Floats, uvs: Floats) -> float:
    """Error of the frame of the gradient of u, made perpendicular to the normal, and of the rest."""
    first, second = np.array([[0.0], [0.0], [2.0]]), np.array([[2.0], [0.0], [0.0]])
    (du1, dv1), (du2, dv2) = uvs[1] - uvs[0], uvs[2] - uvs[0]
    with np.errstate(all="ignore"):
        tangent = (first * dv2 - second * dv1) / (du1 * dv2 - dv1 * du2)
        rest = tangent - smooth * dot(tangent, smooth)
        rest = rest / np.sqrt(dot(rest, rest))
        beside = cross(smooth, rest)
        off = np.maximum(np.abs(dot(rest, smooth)), np.abs(dot(beside, beside) - 1))
    return float(off[0]) / (16 * EPS)


CASES: Cases = {
    "G7: normal-map texels that say nothing": silent_texels,
    "G11: a flat normal map on a smooth mesh": flat_map,
    "G8: frames near the lower pole": frames,
    "G8: tangents that say nothing": silent_tangents,
}
