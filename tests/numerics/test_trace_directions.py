"""`trace` counts t in units of the direction, and nothing else depends on the direction's length."""

import math
from typing import Any

import numpy as np
import pytest

from schemas.quality import FixedQuality
from schemas.quantities import FARTHEST, LONGEST, SHORTEST
from schemas.reading import read_scene
from tests.documents import bulb, ellipsoid, lamp, rectangle, scene, sphere, triangle
from tests.numerics import oracle
from tests.numerics.judging import flat_details, round_details, rounded
from tests.numerics.random_scenes import drawn, mesh, nearest, seen, ways_to_lights
from tests.numerics.tracing import traced
from tests.pictures.parts import DOUBLE, SINGLE

SCENES = pytest.mark.parametrize("seed", range(3))
BOTH = pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])


def of_any_length(directions: np.ndarray, seed: int) -> np.ndarray:
    """Unit vectors made 1e-30 to 1e25 long."""
    return directions * 10 ** np.random.default_rng(seed).uniform(-30, 25, (len(directions), 1))


@SCENES
def test_rays_of_any_length_hit_what_exact_arithmetic_says(seed: int) -> None:
    given = drawn(seed)
    directions = of_any_length(given.directions, seed)
    hits, kinds = given.hits(directions, DOUBLE), set()
    for i, (origin, direction) in enumerate(zip(given.origins, directions, strict=True)):
        expected = nearest(given.parts, origin, direction)
        if expected is None:
            assert (hits.shape[i], hits.t[i]) == (-1, math.inf)
            continue
        part, true = expected
        assert (hits.shape[i], hits.primitive[i]) == (part.shape, part.primitive)
        details = round_details if part.kind == "ellipsoid" else flat_details
        found = hits.position[i], hits.normal[i], hits.uv[i]
        assert abs(hits.t[i] - true.t) <= rounded(part.exact, true, origin, direction)
        assert details(part.exact, true, (origin, direction), found) <= 1
        kinds.add(part.kind)
    assert kinds == {"triangle", "mesh", "rectangle", "ellipsoid"}


@BOTH
@SCENES
def test_visibility_is_the_exact_share_of_light_points(seed: int, quality: FixedQuality) -> None:
    """Light points within 16 roundings of a shadow's border may count or not."""
    given = drawn(seed)
    directions = of_any_length(given.directions, seed)
    hits = given.hits(directions, quality)
    margin = 16 * float(np.finfo(quality.precision).eps)
    partly = 0
    for i, (origin, direction) in enumerate(zip(given.origins, directions, strict=True)):
        expected = nearest(given.parts, origin, direction)
        if expected is None:
            assert (hits.visibility[i] == 0).all()
            continue
        place = hits.position[i]
        for light, (ways, end) in enumerate(ways_to_lights(place)):
            answers = [seen(given.parts, *expected, place, way, end, margin) for way in ways]
            least, most = answers.count(True), len(ways) - answers.count(False)
            assert least <= hits.visibility[i, light] * len(ways) <= most
            partly += 0 < most < len(ways)
    assert partly


@BOTH
@SCENES
def test_a_power_of_two_scales_t_and_changes_no_other_bit(seed: int, quality: FixedQuality) -> None:
    """2^-99 and 2^83 are about 1e-30 and 1e25."""
    given = drawn(seed)
    powers = np.random.default_rng(seed).integers(-99, 84, len(given.directions))
    hits, unit = (
        given.hits(np.ldexp(given.directions, power[:, None]), quality) for power in (powers, 0 * powers)
    )
    assert np.isfinite(unit.t).sum() > 20
    assert (np.ldexp(hits.t, powers) == unit.t).all()
    for name in ("position", "normal", "uv", "shape", "primitive", "visibility"):
        assert getattr(hits, name).tobytes() == getattr(unit, name).tobytes()


CORNERS = [[-1.0, -1, 0.5], [3, -1, 0.25], [-1, 3, 0.75]]
SHAPES = {
    "triangle": triangle(*CORNERS),
    "mesh": mesh(np.array([CORNERS] + [np.array(CORNERS) - [0, 0, i] for i in range(1, 50)])),
    "rectangle": rectangle([-1, -1, 0.5], [2, 0, 0.5], [0, 3, 0.25]),
    "ellipsoid": ellipsoid([0, 0, 0], [1, 0, 0], [0, 3, 0], [0, 0, 2]),
}


@pytest.mark.parametrize("length", [SHORTEST, 1.0, LONGEST])
@pytest.mark.parametrize("distance", [2.0**60, FARTHEST])
@pytest.mark.parametrize("shape", SHAPES)
def test_a_ray_from_as_far_as_is_allowed_hits_what_it_aims_at(
    shape: str, distance: float, length: float
) -> None:
    hits = traced([SHAPES[shape]], [[0.25, 0.125, distance]], [[0, 0, -length]], lights=[bulb([0, 0, 9])])
    single = SHAPES[shape] if shape != "mesh" else SHAPES["triangle"]
    true = oracle.answer(read_scene(scene(single))[0].shapes[0], [0.25, 0.125, distance], [0, 0, -length])
    assert (hits.shape[0], hits.primitive[0], hits.visibility[0, 0]) == (0, 0, 1)
    assert hits.t[0] == pytest.approx(true.t, rel=2.0**-50)
    assert np.abs(hits.position[0, :2] - [0.25, 0.125]).max() <= 2.0**-50
    assert np.abs(hits.normal[0] - true.normal).max() <= 2.0**-48


@pytest.mark.parametrize(
    ("name", "row", "value"),
    [
        ("origins", 1, [0, -1.01 * FARTHEST, 0]),
        ("origins", 2, [0, 0, 1e200]),
        ("directions", 0, [5e-324, 0, 0]),
        ("directions", 1, [0, 0.99 * SHORTEST, 1e-320]),
        ("directions", 2, [0, 0, -1.01 * LONGEST]),
    ],
)
def test_rays_whose_t_no_number_holds_are_refused(name: str, row: int, value: list[float]) -> None:
    rays: dict[str, Any] = {"origins": [[0.0, 0, 5]] * 3, "directions": [[0.0, 0, -1]] * 3}
    rays[name][row] = value
    with pytest.raises(ValueError, match=rf"component in row {row} of '{name}' must be between"):
        traced([SHAPES["triangle"]], **rays)


@BOTH
def test_a_light_point_in_a_tiny_ball_is_hidden(quality: FixedQuality) -> None:
    """A radius of 1e-25: in its frame the squares of the lamp's edges are beyond float32."""
    floor = rectangle([-5, 0, -5], [0, 0, 10], [10, 0, 0])
    light = lamp([-2, 4, -2], [4, 0, 0], [0, 0, 4])
    shapes = [floor, sphere([1, 4, 1], 1e-25)]
    hits = traced(shapes, [[0.3, 2, 0.7]], [[0, -1, 0]], lights=[light], points=4, quality=quality)
    assert hits.visibility[0, 0] == 0.75
