"""What rays all over a pixel tell of it: flat sheets seen straight on, so that shares can be counted."""

from collections import Counter
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from renderer.adaptive import coverage
from renderer.adaptive.camera_rays import camera_rays
from renderer.adaptive.coverage import SIZES, UNEVEN, Cover, cover, size_for, surroundings
from renderer.adaptive.levels import COVERED, LOOKED
from renderer.adaptive.samples import render_samples
from renderer.execute import radiance
from renderer.hard_cases.documents import Json, bulb, camera, lamp, phong, rectangle, sampled, scene
from renderer.plan import RenderPlan
from schemas.quality import TargetQuality
from schemas.tiles import Tile
from tests.images import pictures

EPS = 2.0**-52
SINGLE = 2.0**-24
"""Relative error of one rounding to float32."""
Numbers = NDArray[np.float64]
Looks = tuple[NDArray[np.float32], NDArray[np.int32]]

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


def first_looks(plan: RenderPlan) -> Looks:
    """Values (3, H, W) and labels (H, W)."""
    none = np.zeros((plan.height, plan.width), dtype=np.uint8)
    found = render_samples(plan, whole(plan), none, none + np.uint8(LOOKED))
    return found.looks.reshape(3, *none.shape), found.labels.reshape(none.shape)


def pixels_of(plan: RenderPlan) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Columns and rows of all pixels, row by row."""
    rows, columns = np.divmod(np.arange(plan.width * plan.height), plan.width)
    return columns, rows


def covered(
    plan: RenderPlan, count: int = 13, looks: Looks | None = None, counts: Counter[str] | None = None
) -> Cover:
    """All pixels of a picture, row by row."""
    columns, rows = pixels_of(plan)
    nearby = surroundings(whole(plan), *(looks or first_looks(plan))).nearby(rows, columns)
    return cover(plan.look or plan, count, columns, rows, nearby, Counter() if counts is None else counts)


def on_picture(plan: RenderPlan, count: int) -> Numbers:
    """Where the rays of all pixels pass, (2, N, count), in pixels from the top left corner."""
    corners = np.array(pixels_of(plan))
    return corners[:, :, None] + coverage.places(plan.seed, np.arange(corners.shape[1]), count)


def hits(plan: RenderPlan, count: int, sheet: Sheet) -> NDArray[np.bool_]:
    """Which rays of each pixel (N, count) meet a sheet."""
    corner, edges = np.array(sheet[0])[:, None, None], np.array(sheet[1:]).T
    u, v = np.tensordot(np.linalg.inv(edges), on_picture(plan, count) - corner, axes=1)
    met: NDArray[np.bool_] = (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1)
    return met


def mixed(shares: Numbers) -> Numbers:
    """Values (3, N) of pixels with shares (N,) of a sheet."""
    return RED[:, None] * shares + BLUE[:, None] * (1 - shares)


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


@pytest.mark.parametrize("count", SIZES)
def test_no_two_places_in_a_pixel_share_a_column_or_a_row(count: int) -> None:
    """Along each axis they are 1 / n apart, and go on around the pixel."""
    for axis in coverage.places(5, np.arange(100), count):
        assert ((axis >= 0) & (axis < 1)).all()
        gaps = np.diff(np.sort(axis, axis=1), axis=1, append=axis.min(axis=1, keepdims=True) + 1)
        # A place is a sum below 1 + n, taken to less than 1.
        assert np.abs(gaps - 1 / count).max() <= 4 * count * EPS


def test_each_pixel_and_each_seed_has_a_shift_of_its_own() -> None:
    """Two of 4000 shifts of 48 bits are the same once in 35 million times."""
    shifts = [np.array(coverage.places(seed, np.arange(2000), 5))[:, :, 0] for seed in (0, 1)]
    assert np.unique(np.hstack(shifts), axis=1).shape[1] == 4000


def errors_of(count: int, normals: Numbers, bounds: Numbers) -> Numbers:
    """Of the share of the places in pixel i on the lower side of line i."""
    across, along = coverage.places(3, np.arange(bounds.size), count)
    inside = normals[0] * across.T + normals[1] * along.T <= bounds
    errors: Numbers = inside.mean(axis=0) - below(normals, bounds)
    return errors


@pytest.mark.parametrize("count", [5, 13, 34])
@pytest.mark.parametrize("degrees", [1, 30, 45, 88, 120, 200, 315])
def test_shares_are_unbiased(count: int, degrees: float) -> None:
    """Over 5000 pixels within 4 standard errors: one set of 21 such tests in 750 has one beyond."""
    angle = np.full(5000, np.radians(degrees))
    normals = np.array([np.cos(angle), np.sin(angle)])
    bounds = (normals * [[0.37], [0.61]]).sum(axis=0)
    errors = errors_of(count, normals, bounds)
    assert abs(errors.mean()) <= 4 * errors.std() / np.sqrt(errors.size)


def test_the_error_of_a_share_falls_like_the_number_of_rays_to_the_power_of_minus_three_quarters() -> None:
    """Over edges of all directions, within a tenth; random places have a power of -1/2, a row of them -1."""
    random = np.random.default_rng(2)
    angles = random.uniform(0, 2 * np.pi, 10_000)
    normals = np.array([np.cos(angles), np.sin(angles)])
    bounds = (normals * random.uniform(size=normals.shape)).sum(axis=0)
    errors = [np.sqrt((errors_of(count, normals, bounds) ** 2).mean()) for count in SIZES]
    power, _ = np.polyfit(np.log(list(SIZES)), np.log(errors), 1)
    assert abs(power + 3 / 4) <= 1 / 10


def test_smaller_errors_ask_for_more_rays_in_step_with_the_error_that_they_leave() -> None:
    """Neighbours in the table are less than 1.67 apart, and the nearest one less than the root of that."""
    sizes = [size_for(error) for error in np.geomspace(1, 1e-6, 400)]
    assert sizes == sorted(sizes)
    assert set(sizes) == set(SIZES)
    count, error = coverage.ENOUGH
    for share in np.geomspace(2, 1 / 5, 100):
        assert abs(np.log((size_for(error * share) / count) ** 0.75 * share)) <= 0.75 * np.log(1.67) / 2


@pytest.mark.parametrize("count", [5, 13, 89])
@pytest.mark.parametrize("sheet", [SLANTED, THIN], ids=["slanted", "thin"])
def test_pixels_show_things_by_the_share_of_rays_that_meet_them(sheet: Sheet, count: int) -> None:
    plan = plan_of(picture(rectangle(*at(sheet))))
    shares = hits(plan, count, sheet).mean(axis=1)
    assert ((shares > 0) & (shares < 1)).any()
    assert rounded(covered(plan, count).values, mixed(shares))


def test_lights_that_the_camera_sees_are_things_like_others() -> None:
    plan = plan_of(picture(lights=[lamp(*at(SLANTED), color=RED.tolist())]))
    assert set(np.unique(first_looks(plan)[1])) == {-2, -1}
    assert rounded(covered(plan).values, mixed(hits(plan, 13, SLANTED).mean(axis=1)))


def test_what_no_first_look_has_met_is_looked_at_once_in_each_pixel() -> None:
    plan = plan_of(picture(rectangle(*at(THIN))))
    assert (first_looks(plan)[1] == -1).all()
    counts: Counter[str] = Counter()
    covered(plan, counts=counts)
    met = hits(plan, 13, THIN).any(axis=1)
    assert counts["camera"] == 13 * met.size + met.sum()
    assert counts["shading_points"] == met.sum()


def test_it_is_looked_at_by_the_ray_nearest_to_the_middle_of_those_that_met_it() -> None:
    """A bulb close by makes each place on it as bright as no other. Two rays may be as near as each other."""
    plan, count = plan_of(picture(rectangle(*at(THIN)), materials=MATT, lights=[bulb([2, 1, 1])])), 34
    met = hits(plan, count, THIN)
    chosen = np.flatnonzero(met.any(axis=1))
    met, pixels = met[chosen], np.array(pixels_of(plan))[:, chosen]
    places = on_picture(plan, count)[:, chosen] - pixels[:, :, None]
    middle = (places * met).sum(axis=2) / met.sum(axis=1)
    away = np.where(met, ((places - middle[:, :, None]) ** 2).sum(axis=0), np.inf)
    x, y = places[:, np.arange(chosen.size), away.argmin(axis=1)]
    assert plan.look is not None
    seen = radiance(plan.look, camera_rays(plan.look, pixels[0], pixels[1], chosen, (x, y)), Counter())
    assert np.unique(seen[0]).size == chosen.size
    values = seen * met.mean(axis=1) + BLUE[:, None] * (1 - met.mean(axis=1))
    first, second = np.sort(away, axis=1)[:, :2].T
    clear = second - first > 16 * EPS
    assert clear.sum() > 4
    assert rounded(covered(plan, count).values[:, chosen[clear]], values[:, clear])


def lit(**material: Any) -> RenderPlan:
    """A sheet beyond all borders, lit by a bulb before it, in the middle more than is shown."""
    sheet = rectangle(*at(((-1.0, -1.0), (SIDE + 2.0, 0.0), (0.0, SIDE + 2.0))))
    materials = {"plain": phong(ambient=0.1, **material)}
    return plan_of(picture(sheet, materials=materials, lights=[bulb([2.3, 1.1, 3], [2, 1.5, 1])]))


@pytest.mark.parametrize("material", [{}, {"mirror": 0.3}], ids=["plain", "fine"])
def test_a_pixel_that_shows_what_its_own_look_met_keeps_that_to_the_bit(material: Json) -> None:
    plan = lit(**material)
    values, labels = first_looks(plan)
    assert np.unique(values[0]).size > SIDE
    counts: Counter[str] = Counter()
    assert covered(plan, looks=(values, labels), counts=counts).values.tobytes() == values.tobytes()
    assert counts == {"camera": 13 * labels.size}


@pytest.mark.parametrize(
    ("material", "borrows"),
    [({}, True), ({"color_texture": "board"}, False), ({"mirror": 0.5}, False)],
    ids=["plain", "texture", "mirror"],
)
def test_only_what_is_smooth_is_taken_from_the_looks_of_neighbours(material: Json, borrows: bool) -> None:
    """A sheet over the left half and three tenths of a column more. Looks at it are changed: pixels whose own
    look met the background may learn of that.
    """
    board = {"type": "checker", "even": [0.5, 0.75, 1], "odd": [0.5, 0.25, 0], "repeat": [3, 5]}
    materials = {"plain": phong(ambient=1, diffuse=0, **material)}
    sheet = rectangle(*at(((-1.0, -1.0), (SIDE / 2 + 1.3, 0.0), (0.0, SIDE + 2.0))))
    plan = plan_of(picture(sheet, materials=materials, textures={"board": board}))
    values, labels = first_looks(plan)
    assert (labels == np.where(np.arange(SIDE) < SIDE / 2, 0, -1)).all()
    changed = np.where(labels == 0, np.float32(2), values)
    truth, told = (covered(plan, looks=(v, labels)).values.reshape(values.shape) for v in (values, changed))
    column = SIDE // 2
    assert set((told != truth)[:, :, column].ravel().tolist()) == {borrows}
    assert (told[:, :, :column] == 2).all()
    assert (told[:, :, column + 1 :] == truth[:, :, column + 1 :]).all()


def test_of_neighbours_those_beside_a_pixel_are_asked_before_those_at_its_corners() -> None:
    """A sheet is seen with a look of 64 at a corner, then of 1 above as well, then of 2 at the left too."""
    sheet = (7.4, 7.4), (0.9, 0.0), (0.0, 0.9)
    plan = plan_of(picture(rectangle(*at(sheet))))
    values = np.zeros((3, SIDE, SIDE), dtype=np.float32)
    labels = np.full((SIDE, SIDE), -1, dtype=np.int32)
    share = hits(plan, 13, sheet).mean(axis=1).reshape(SIDE, SIDE)[8, 8]
    assert 0 < share < 1
    shown = []
    for row, column, look in ((7, 7, 64), (7, 8, 1), (8, 7, 2)):
        labels[row, column], values[:, row, column] = 0, look
        shown.append(covered(plan, looks=(values, labels)).values.reshape(values.shape)[0, 8, 8])
    assert shown == [np.float32(share * told) for told in (64, 1, 1.5)]


def doubts_of(level: float) -> NDArray[np.float32]:
    """Where a sheet of a grey before one of a quarter."""
    material = phong([1, 1, 1], ambient=1, diffuse=0)
    light = {"background": [0.25] * 3, "ambient": [level] * 3}
    return covered(plan_of(picture(rectangle(*at(SLANTED)), materials={"plain": material}, **light))).doubts


def test_where_one_even_thing_is_seen_there_is_no_doubt() -> None:
    plan = plan_of(picture(rectangle(*at(SLANTED))))
    shares = hits(plan, 13, SLANTED).mean(axis=1)
    assert ((covered(plan).doubts == 0) == ((shares == 0) | (shares == 1))).all()


def test_doubts_grow_with_the_square_of_the_contrast_as_far_as_it_is_seen() -> None:
    """Of 1/4 and 1/2; what is brighter than white is shown as white."""
    low, high = doubts_of(0.5).astype(np.float64), doubts_of(0.75).astype(np.float64)
    assert np.abs(high - 4 * low).max() <= 4 * SINGLE * high.max()
    assert (doubts_of(1.0) > doubts_of(0.75))[high > 0].all()
    assert doubts_of(8.0).tobytes() == doubts_of(1.0).tobytes()


def cut(count: int) -> tuple[Numbers, Numbers]:
    """Errors (3, n) and doubts (n,) of pixels along sixteen edges, one a seed, in all directions."""
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
        told = np.vstack((seen.values - mixed(shares), seen.doubts))
        found.append(told[:, (shares > 0) & (shares < 1)])
    *errors, doubts = np.hstack(found)
    return np.array(errors), doubts


def test_over_many_pixels_values_are_unbiased() -> None:
    """Within 4 standard errors: one such test in 15,000 is beyond."""
    (errors, *_), _ = cut(13)
    assert abs(errors.mean()) <= 4 * errors.std() / np.sqrt(errors.size)


def test_doubts_are_the_squared_errors_in_the_mean_and_fewer_the_more_rays_there_are() -> None:
    """Within a factor of 4: they sort pixels into octaves, and probes tell the rest."""
    means = [((errors**2).mean(), doubts.mean()) for errors, doubts in map(cut, (5, 13, 34))]
    assert all(doubt / 4 <= error <= doubt * 4 for error, doubt in means)
    assert (np.diff(means, axis=0) < 0).all()


def test_uneven_looks_around_leave_a_doubt() -> None:
    """A share of their variance, which float32 tells to a few roundings of their squares."""
    plan = lit()
    values, labels = first_looks(plan)
    padded = np.clip(np.pad(values.astype(np.float64), ((0, 0), (1, 1), (1, 1)), mode="edge"), 0, 1)
    around = np.stack([padded[:, i : i + SIDE, j : j + SIDE] for i in range(3) for j in range(3)])
    expected = UNEVEN * around.var(axis=0).mean(axis=0).ravel()
    found = covered(plan, looks=(values, labels)).doubts
    assert np.abs(found - expected).max() <= UNEVEN * 32 * SINGLE
    assert expected.max() > 100 * UNEVEN * 32 * SINGLE
    assert values.min() < 1 < values.max()


def around(row: int, column: int, size: tuple[int, int], tile: Tile) -> list[int]:
    """Numbers of the pixels of a picture whose looks are taken to be around a pixel of a tile."""
    labels = np.arange(np.prod(size), dtype=np.int32).reshape(size)
    values = np.stack((labels, labels + 100, labels + 200)).astype(np.float32)
    nearby = surroundings(tile, values, labels).nearby(np.array([row]), np.array([column]))
    assert (nearby.values[:, :, 0] == nearby.labels[:, 0] + np.array([[0], [100], [200]])).all()
    return list(nearby.labels[:, 0])


def test_beyond_the_picture_are_the_pixels_at_its_rim() -> None:
    every = (3, 4), Tile(0, 0, 0, 4, 3)
    assert around(1, 1, *every) == [0, 1, 2, 4, 5, 6, 8, 9, 10]
    assert around(0, 0, *every) == [0, 0, 1, 0, 0, 1, 4, 4, 5]
    assert around(0, 3, *every) == [2, 3, 3, 2, 3, 3, 6, 7, 7]
    assert around(2, 0, *every) == [4, 4, 5, 8, 8, 9, 8, 8, 9]
    assert around(2, 3, *every) == [6, 7, 7, 10, 11, 11, 10, 11, 11]
    assert around(0, 0, (1, 1), Tile(0, 0, 0, 1, 1)) == [0] * 9


def test_around_a_tile_are_the_pixels_of_the_tiles_beside_it() -> None:
    size, every, part = (9, 11), Tile(0, 0, 0, 11, 9), Tile(0, 4, 2, 8, 9)
    for row, column in np.ndindex(7, 4):
        assert around(row, column, size, part) == around(row + 2, column + 4, size, every)


def in_tiles(plan: RenderPlan, looks: Looks, side: int) -> NDArray[np.float32]:
    """Values and doubts (4, H, W) of all pixels."""
    found = np.full((4, plan.height, plan.width), np.nan, dtype=np.float32)
    for y, x in product(range(0, plan.height, side), range(0, plan.width, side)):
        tile = Tile(0, x, y, min(x + side, plan.width), min(y + side, plan.height))
        have = np.full((tile.height, tile.width), LOOKED, dtype=np.uint8)
        want = np.full_like(have, COVERED)
        samples = render_samples(plan, tile, have, want, surroundings(tile, *looks))
        part = found[:, y : tile.y1, x : tile.x1]
        part[...] = np.vstack((samples.covers, samples.doubts)).reshape(part.shape)
    return found


def test_no_byte_of_a_pixel_depends_on_its_tile() -> None:
    """So many rays that the whole picture takes several batches."""
    plan = plan_of(pictures.of_room(camera=camera(width=40, height=30)), 2.0**-11)
    looks = first_looks(plan)
    once = in_tiles(plan, looks, 40)
    assert np.isfinite(once).all()
    for side in (7, 16):
        assert in_tiles(plan, looks, side).tobytes() == once.tobytes()


def test_no_byte_of_a_pixel_depends_on_those_looked_at_with_it() -> None:
    """Along a strip that no first look has met, so that each pixel asks for a look of its own."""
    plan = plan_of(picture(rectangle(*at(THIN)), materials=MATT, lights=[bulb([2, 1, 1])]))
    looks = first_looks(plan)
    together = covered(plan, looks=looks)
    columns, rows = pixels_of(plan)
    for i in np.flatnonzero(rows == 7):
        one = np.s_[i : i + 1]
        nearby = surroundings(whole(plan), *looks).nearby(rows[one], columns[one])
        alone = cover(plan.look or plan, 13, columns[one], rows[one], nearby, Counter())
        assert alone.values.tobytes() == together.values[:, one].tobytes()
        assert alone.doubts.tobytes() == together.doubts[one].tobytes()
