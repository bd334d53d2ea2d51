"""What rays all over a pixel show of it: flat sheets seen straight on, so that shares can be counted.

The rays are two independent lattices.
"""

from collections import Counter
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from accuracy.hard_cases.documents import Json, bulb, camera, phong, rectangle, sampled, scene
from renderer.adaptive import coverage
from renderer.adaptive.coverage import UNEVEN, USUAL, Cover, border_rays, cover
from renderer.adaptive.guides import surroundings
from renderer.adaptive.levels import COVERAGES, FIBONACCI, PREVIEWED
from renderer.adaptive.rays import camera_rays
from renderer.adaptive.requests import LevelRequest, TileRequest
from renderer.adaptive.tile_rendering import render_samples
from renderer.integrator import radiance
from renderer.plan.plan import RenderPlan, pilot_of
from schemas.quality import TargetQuality
from schemas.tiles import Tile

EPS = 2.0**-52
SINGLE = 2.0**-24
"""Relative error of one rounding to float32."""
Numbers = NDArray[np.float64]
Pilots = tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32]]

SIDE = 16
"""Of the small pictures, pixels; a scene unit on their sheets is a pixel."""

RED, BLUE = np.array([0.75, 0.5, 0.125]), np.array([0.125, 0.25, 0.5])
"""Of sheets and of the background: short in binary, so that sums of nine are exact."""

MATT = {"plain": phong([0.9, 0.8, 0.7], ambient=0, diffuse=1)}
SLANTED = (3.3, 2.1), (9.7, 3.2), (-2.4, 8.6)
THIN = (1.2, 7.05), (13.0, 0.2), (0.0, 0.1)
Sheet = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


def at(sheet: Sheet) -> tuple[list[float], list[float], list[float]]:
    """Corner and edges of a sheet, which is written in pixels from the top left corner of the picture."""
    (x, y), (a, b), (c, d) = sheet
    return [x - SIDE / 2, SIDE / 2 - y, 0], [a, -b, 0], [c, -d, 0]


def picture(*shapes: Json, **changes: Any) -> Json:
    """Sheets before an even background, without a light."""
    view = camera(position=[0, 0, SIDE / 2], look_at=[0, 0, 0], vertical_fov=90, width=SIDE, height=SIDE)
    plain = phong(RED.tolist(), ambient=1, diffuse=0)
    base = {"camera": view, "background": BLUE.tolist(), "ambient": [1, 1, 1], "materials": {"plain": plain}}
    return scene(*shapes, **{**base, **changes})


def plan_of(document: Json, error: float = 2.0**-8) -> RenderPlan:
    return renderer.compile_scene(document, TargetQuality(mode="target", error=error))


def whole(plan: RenderPlan) -> Tile:
    return Tile(0, 0, 0, plan.width, plan.height)


def pilot_samples(plan: RenderPlan) -> Pilots:
    """Values (3, H, W), labels (H, W) and colours (3, H, W)."""
    size = plan.height, plan.width
    found = render_samples(
        plan, TileRequest(whole(plan), LevelRequest.first(np.full(size, PREVIEWED, dtype=np.uint8)))
    )
    return found.pilots.reshape(3, *size), found.labels.reshape(size), found.colors.reshape(3, *size)


def flat(values: NDArray[np.float32], labels: NDArray[np.int32]) -> Pilots:
    """Pilot samples without textures."""
    return values, labels, np.ones_like(values)


def number_of(count: int) -> int:
    """That of a coverage with so many rays in each lattice."""
    return FIBONACCI.index(count) + 1


def pixels_of(plan: RenderPlan) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Columns and rows of all pixels, row by row."""
    rows, columns = np.divmod(np.arange(plan.width * plan.height), plan.width)
    return columns, rows


def covered(
    plan: RenderPlan, count: int = 13, pilots: Pilots | None = None, counts: Counter[str] | None = None
) -> Cover:
    """All pixels of a picture, row by row."""
    columns, rows = pixels_of(plan)
    nearby = surroundings(whole(plan), *(pilots or pilot_samples(plan))).nearby(rows, columns)
    size, rays = number_of(count), Counter() if counts is None else counts
    return cover(plan, size, columns, rows, nearby, rays)


def on_picture(plan: RenderPlan, count: int) -> Numbers:
    """Where the rays of all pixels pass, (2, N, lattices, count), in pixels from the top left corner."""
    corners = np.array(pixels_of(plan))
    return corners[:, :, None, None] + coverage.places(plan.seed, np.arange(corners.shape[1]), count)


def hits(plan: RenderPlan, count: int, sheet: Sheet) -> NDArray[np.bool_]:
    """Which rays of each pixel (N, lattices, count) hit a sheet."""
    corner, edges = np.array(sheet[0])[:, None, None, None], np.array(sheet[1:]).T
    u, v = np.tensordot(np.linalg.inv(edges), on_picture(plan, count) - corner, axes=1)
    hit: NDArray[np.bool_] = (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1)
    return hit


def mixed(shares: Numbers) -> Numbers:
    """Values (3, N) of pixels with shares (N,) of a sheet."""
    return RED[:, None] * shares + BLUE[:, None] * (1 - shares)


def shares_of(plan: RenderPlan, count: int, sheet: Sheet) -> Numbers:
    """Shares (N,) of a sheet among the rays of both lattices."""
    shares: Numbers = hits(plan, count, sheet).mean(axis=(1, 2))
    return shares


def rounded(found: NDArray[np.float32], expected: Numbers) -> bool:
    """Whether values are the expected ones, rounded once to float32."""
    return bool((np.abs(found - expected) <= (SINGLE + 8 * EPS) * np.abs(expected)).all())


def below(normals: Numbers, bounds: Numbers) -> Numbers:
    """Areas (n,) of the unit square where p . normals <= bounds (n,): a sum over its corners."""
    a, b = np.abs(normals)
    d = bounds - np.minimum(normals, 0).sum(axis=0)
    near, far = np.maximum((d, d - a - b), 0) ** 2
    beside, above = np.maximum((d - a, d - b), 0) ** 2
    areas: Numbers = (near - beside - above + far) / (2 * a * b)
    return areas


@pytest.mark.parametrize("count", FIBONACCI[:-6])
def test_no_two_places_in_a_pixel_share_a_column_or_a_row(count: int) -> None:
    """Along each axis they are 1 / n apart, and wrap around the pixel."""
    for places in coverage.places(5, np.arange(50), count):
        axis = places.reshape(-1, count)
        assert ((axis >= 0) & (axis < 1)).all()
        gaps = np.diff(np.sort(axis, axis=1), axis=1, append=axis.min(axis=1, keepdims=True) + 1)
        # A place is a sum below 1 + n, taken to less than 1.
        assert np.abs(gaps - 1 / count).max() <= 4 * count * EPS


def test_each_lattice_of_a_pixel_and_each_seed_has_a_shift_of_its_own() -> None:
    """Two of 8000 shifts of 48 bits are the same once in 9 million times."""
    shifts = [np.array(coverage.places(seed, np.arange(2000), 5))[..., 0].reshape(2, -1) for seed in (0, 1)]
    assert np.unique(np.hstack(shifts), axis=1).shape[1] == 8000


def errors_of(count: int, normals: Numbers, bounds: Numbers) -> Numbers:
    """Of the share of the places of each lattice in pixel i on the lower side of line i, (lattices, n)."""
    across, along = coverage.places(3, np.arange(bounds.size), count)
    inside = normals[0] * across.T + normals[1] * along.T <= bounds
    errors: Numbers = inside.mean(axis=0) - below(normals, bounds)
    return errors


@pytest.mark.parametrize("count", [5, 13, 34])
@pytest.mark.parametrize("degrees", [1, 30, 45, 88, 120, 200, 315])
def test_shares_are_unbiased(count: int, degrees: float) -> None:
    """Over both lattices of 5000 pixels within 4 standard errors: one set of 21 such tests in 750 has one
    beyond.
    """
    angle = np.full(5000, np.radians(degrees))
    normals = np.array([np.cos(angle), np.sin(angle)])
    bounds = (normals * [[0.37], [0.61]]).sum(axis=0)
    errors = errors_of(count, normals, bounds)
    assert abs(errors.mean()) <= 4 * errors.std() / np.sqrt(errors.size)


def test_the_error_of_a_share_falls_like_the_number_of_rays_to_the_power_of_minus_three_quarters() -> None:
    """Of both lattices, over edges of all directions, within a tenth.

    Random places have a power of -1/2, a row of them -1.
    """
    random = np.random.default_rng(2)
    angles = random.uniform(0, 2 * np.pi, 10_000)
    normals = np.array([np.cos(angles), np.sin(angles)])
    bounds = (normals * random.uniform(size=normals.shape)).sum(axis=0)
    counts = FIBONACCI[:11]
    both = [errors_of(count, normals, bounds).mean(axis=0) for count in counts]
    errors = [np.sqrt((each**2).mean()) for each in both]
    power, _ = np.polyfit(np.log(2.0 * np.array(counts)), np.log(errors), 1)
    assert abs(power + 3 / 4) <= 1 / 10


@pytest.mark.parametrize("count", [5, 34])
def test_the_lattices_of_a_pixel_are_independent(count: int) -> None:
    """So that their difference estimates the error of their mean: 20,000 edges, and a product of zero within
    5 standard errors; half the squared difference is that of one, within 5 as well.
    """
    random = np.random.default_rng(7)
    angles = random.uniform(0, 2 * np.pi, 20_000)
    normals = np.array([np.cos(angles), np.sin(angles)])
    first, second = errors_of(count, normals, (normals * random.uniform(size=normals.shape)).sum(axis=0))
    for zero in (first * second, (first - second) ** 2 / 4 - ((first + second) / 2) ** 2):
        assert abs(zero.mean()) <= 5 * zero.std() / np.sqrt(zero.size)


def test_smaller_errors_are_predicted_to_take_more_rays_in_step_with_the_error_that_they_leave() -> None:
    """The error falls like their number to the power -3 / 4; the number stays within the allowed range."""
    count, error = USUAL
    for share in np.geomspace(2, 1 / 100, 40):
        assert border_rays(error * share) == pytest.approx(count * share ** (-4 / 3), rel=1e-12)
    assert (border_rays(1.0), border_rays(1e-9)) == (COVERAGES[1], COVERAGES[-1])


@pytest.mark.parametrize("count", [5, 13, 89])
@pytest.mark.parametrize("sheet", [SLANTED, THIN], ids=["slanted", "thin"])
def test_pixels_show_things_by_the_share_of_rays_that_hit_them(sheet: Sheet, count: int) -> None:
    plan = plan_of(picture(rectangle(*at(sheet))))
    hit = hits(plan, count, sheet).mean(axis=2)
    shares = hit.mean(axis=1)
    assert ((shares > 0) & (shares < 1)).any()
    found = covered(plan, count)
    assert rounded(found.values, mixed(shares))
    # The lattices' shares are multiples of 1 / count; differences and squares of colours round a few times.
    apart = (((RED - BLUE)[:, None] * (hit[:, 0] - hit[:, 1])) ** 2).mean(axis=0) / 4
    assert np.abs(found.spread - apart).max() <= SINGLE * apart.max() + 8 * EPS
    assert (found.spread > 0).any()


def test_what_is_brighter_than_white_has_no_spread_where_white_is_shown_in_any_case() -> None:
    """A sheet of 3 before a background of 2."""
    light = {"background": [2.0] * 3, "ambient": [3.0] * 3}
    material = {"plain": phong([1, 1, 1], ambient=1, diffuse=0)}
    found = covered(plan_of(picture(rectangle(*at(SLANTED)), materials=material, **light)), 5)
    assert np.unique(found.values).size > 2
    assert not found.spread.any()


def test_known_is_what_neighbouring_pilot_samples_show_and_the_rest_is_shaded_anew() -> None:
    """No pilot sample hits a thin strip; where rays hit it, the background's share is known."""
    plan = plan_of(picture(rectangle(*at(THIN))))
    found, shares = covered(plan), shares_of(plan, 13, THIN)
    assert rounded(found.known, BLUE[:, None] * (1 - shares))
    assert rounded(found.values, mixed(shares))
    bare = shares == 0
    assert (found.known[:, bare] == found.values[:, bare]).all()


def test_what_no_pilot_sample_has_hit_is_shaded_once_in_each_lattice() -> None:
    plan = plan_of(picture(rectangle(*at(THIN))))
    assert (pilot_samples(plan)[1] == -1).all()
    counts: Counter[str] = Counter()
    covered(plan, counts=counts)
    hit = hits(plan, 13, THIN).any(axis=2)
    assert counts["camera"] == 13 * hit.size + hit.sum()
    assert counts["shading_points"] == hit.sum()


def test_it_is_shaded_by_the_ray_nearest_to_the_middle_of_those_that_hit_it() -> None:
    """A bulb close by makes each place on it as bright as no other. Two rays may be as near as each other."""
    plan, count = plan_of(picture(rectangle(*at(THIN)), materials=MATT, lights=[bulb([2, 1, 1])])), 34
    hit = hits(plan, count, THIN).reshape(-1, count)
    chosen = np.flatnonzero(hit.any(axis=1))
    hit, pixels = hit[chosen], np.array(pixels_of(plan)).repeat(2, axis=1)[:, chosen]
    places = on_picture(plan, count).reshape(2, -1, count)[:, chosen] - pixels[:, :, None]
    middle = (places * hit).sum(axis=2) / hit.sum(axis=1)
    away = np.where(hit, ((places - middle[:, :, None]) ** 2).sum(axis=0), np.inf)
    x, y = places[:, np.arange(chosen.size), away.argmin(axis=1)]
    pilot = pilot_of(plan)
    seen = radiance(pilot, camera_rays(pilot, pixels[0], pixels[1], chosen, (x, y)), Counter())
    assert np.unique(seen[0]).size == chosen.size
    lattices = np.repeat(BLUE[:, None], 2 * SIDE * SIDE, axis=1)
    share = hit.mean(axis=1)
    lattices[:, chosen] = seen * share + BLUE[:, None] * (1 - share)
    values = lattices.reshape(3, -1, 2).mean(axis=2)
    first, second = np.sort(away, axis=1)[:, :2].T
    clear = np.ones(SIDE * SIDE, bool)
    clear[chosen[second - first <= 16 * EPS] // 2] = False
    compared = clear & np.isin(np.arange(clear.size), chosen // 2)
    assert compared.sum() > 4
    assert rounded(covered(plan, count).values[:, compared], values[:, compared])


def lit(**material: Any) -> RenderPlan:
    """A sheet beyond all borders, lit by a bulb before it, in the middle more than is shown."""
    sheet = rectangle(*at(((-1.0, -1.0), (SIDE + 2.0, 0.0), (0.0, SIDE + 2.0))))
    materials = {"plain": phong(ambient=0.1, **material)}
    return plan_of(picture(sheet, materials=materials, lights=[bulb([2.3, 1.1, 3], [2, 1.5, 1])]))


@pytest.mark.parametrize("material", [{}, {"mirror": 0.3}], ids=["plain", "fine"])
def test_a_pixel_that_shows_what_its_own_pilot_sample_hit_keeps_that_to_the_bit(material: Json) -> None:
    plan = lit(**material)
    values, labels, colors = pilot_samples(plan)
    assert np.unique(values[0]).size > SIDE
    counts: Counter[str] = Counter()
    found = covered(plan, pilots=(values, labels, colors), counts=counts)
    assert found.values.tobytes() == found.known.tobytes() == values.tobytes()
    assert not found.spread.any()
    assert counts == {"camera": 2 * 13 * labels.size}


def test_where_one_even_thing_is_seen_there_is_no_spread() -> None:
    """Nor is there doubt about what is even."""
    plan = plan_of(picture(rectangle(*at(SLANTED))))
    found, hit = covered(plan), hits(plan, 13, SLANTED).mean(axis=2)
    assert ((found.spread == 0) == (hit[:, 0] == hit[:, 1])).all()
    assert not found.doubts.any()


def spread_of(level: float) -> NDArray[np.float32]:
    """Where a sheet of a grey before one of a quarter."""
    material = phong([1, 1, 1], ambient=1, diffuse=0)
    light = {"background": [0.25] * 3, "ambient": [level] * 3}
    return covered(plan_of(picture(rectangle(*at(SLANTED)), materials={"plain": material}, **light))).spread


def test_spread_grows_with_the_square_of_the_contrast_as_far_as_it_is_seen() -> None:
    """Of 1/4 and 1/2; of what is brighter than white no more than white is shown of each lattice."""
    low, high = spread_of(0.5).astype(np.float64), spread_of(0.75).astype(np.float64)
    assert np.abs(high - 4 * low).max() <= 4 * SINGLE * high.max()
    assert (spread_of(1.0) > spread_of(0.75))[high > 0].all()
    assert spread_of(8.0).max() <= 1 / 4


def cut(count: int) -> tuple[Numbers, Numbers]:
    """Errors (3, n) and spread (n,) of pixels along sixteen edges, one a seed, in all directions."""
    found = []
    for seed, angle in enumerate(0.1 + np.arange(16) * np.pi / 8):
        along = 60 * np.array([np.cos(angle), np.sin(angle)])
        inwards = np.array([-along[1], along[0]])
        corner = np.array([7.9, 8.3]) - along / 2
        sheet = rectangle(*at((tuple(corner), tuple(along), tuple(inwards))))
        plan = plan_of(picture(sheet, sampling=sampled(seed=seed)))
        depths = inwards @ (corner[:, None] - pixels_of(plan))
        shares = 1 - below(inwards[:, None].repeat(depths.size, axis=1), depths)
        seen = covered(plan, count)
        rows = np.vstack((seen.values - mixed(shares), seen.spread))
        found.append(rows[:, (shares > 0) & (shares < 1)])
    *errors, spread = np.hstack(found)
    return np.array(errors), spread


def test_over_many_pixels_values_are_unbiased() -> None:
    """Within 4 standard errors: one such test in 15,000 is beyond."""
    (errors, *_), _ = cut(13)
    assert abs(errors.mean()) <= 4 * errors.std() / np.sqrt(errors.size)


def test_spread_is_the_squared_error_in_the_mean_and_less_the_more_rays_there_are() -> None:
    """Within 5 standard errors: beyond, one such set of three tests in half a million is."""
    means = []
    for errors, spread in map(cut, (5, 13, 34)):
        squares = (errors**2).mean(axis=0)
        zero = squares - spread
        assert abs(zero.mean()) <= 5 * zero.std() / np.sqrt(zero.size)
        means.append((squares.mean(), spread.mean()))
    assert (np.diff(means, axis=0) < 0).all()


def test_uneven_pilot_samples_around_leave_a_doubt() -> None:
    """A share of their variance, which float32 gives to a few roundings of their squares."""
    plan = lit()
    values, labels, _ = pilot_samples(plan)
    padded = np.clip(np.pad(values.astype(np.float64), ((0, 0), (1, 1), (1, 1)), mode="edge"), 0, 1)
    around = np.stack([padded[:, i : i + SIDE, j : j + SIDE] for i in range(3) for j in range(3)])
    expected = UNEVEN * around.var(axis=0).mean(axis=0).ravel()
    found = covered(plan, pilots=flat(values, labels)).doubts
    assert np.abs(found - expected).max() <= UNEVEN * 32 * SINGLE
    assert expected.max() > 100 * UNEVEN * 32 * SINGLE
    assert values.min() < 1 < values.max()
