"""Control variates: what pilot samples predict about the brightness of what a ray hits."""

import numpy as np
import pytest
from numpy.typing import NDArray

from accuracy.hard_cases.documents import Json, bulb, phong, rectangle
from renderer.adaptive.guides import Nearby, guide, surroundings
from renderer.adaptive.levels import PREVIEWED, SAMPLED
from renderer.adaptive.requests import LevelRequest, TileRequest
from renderer.adaptive.tile_rendering import render_samples
from renderer.plan.plan import RenderPlan, adaptive_part
from tests.renderer.adaptive.test_coverage import (
    SIDE,
    at,
    covered,
    flat,
    picture,
    pilot_samples,
    pixels_of,
    plan_of,
    shares_of,
    whole,
)

Numbers = NDArray[np.float64]


def one(labels: list[int], values: list[float], fine: list[bool] | None = None) -> dict[int, float | None]:
    """Brightness of each label around a pixel, None where none is known."""
    levels = np.repeat(np.array(values, np.float32)[None, :, None], 3, axis=0)
    around = guide(
        Nearby(levels, np.array(labels, np.int32)[:, None]), np.array(fine or [False] * 4), np.zeros((3, 0))
    )
    requested = np.array([*sorted(set(labels)), 3], np.int32)
    radiance, known = around.at(requested, np.zeros(requested.size, np.int64))
    assert not radiance[:, ~known].any()
    assert (radiance[0] == radiance[2]).all()
    found = radiance[0].tolist()
    return {
        label: value if is_known else None
        for label, value, is_known in zip(requested.tolist(), found, known.tolist(), strict=True)
    }


def test_of_each_label_the_pixels_own_sample_goes_before_those_beside_it_and_these_before_corners() -> None:
    """Row by row: 0 is its own, 1 lies beside it twice and once at a corner, 2 at corners, -1 beside it."""
    labels, values = [2, 1, 2, 0, 0, 1, 1, -1, 2], [1.0, 2, 3, 4, 5, 6, 7, 8, 11]
    assert one(labels, values) == {0: 5, 1: 4, 2: 5, -1: 8, 3: None}


def test_of_fine_shapes_none_but_the_pixels_own_sample_counts() -> None:
    labels, values = [2, 1, 2, 0, 0, 1, 1, -1, 2], [1.0, 2, 3, 4, 5, 6, 7, 8, 11]
    fine = [True, True, False, False]
    assert one(labels, values, fine) == {0: 5, 1: None, 2: 5, -1: 8, 3: None}


@pytest.mark.parametrize(
    ("material", "borrows"),
    [({}, True), ({"color_texture": "board"}, False), ({"mirror": 0.5}, False)],
    ids=["plain", "texture", "mirror"],
)
def test_only_what_is_smooth_is_taken_from_the_pilot_samples_of_neighbours(
    material: Json, borrows: bool
) -> None:
    """A sheet over the left half and three tenths of a column more. Its pilot samples are
    changed: pixels whose own one hit the background may use them.
    """
    board = {"type": "checker", "even": [0.5, 0.75, 1], "odd": [0.5, 0.25, 0], "repeat": [3, 5]}
    materials = {"plain": phong(ambient=1, diffuse=0, **material)}
    sheet = rectangle(*at(((-1.0, -1.0), (SIDE / 2 + 1.3, 0.0), (0.0, SIDE + 2.0))))
    plan = plan_of(picture(sheet, materials=materials, textures={"board": board}))
    values, labels, _ = pilot_samples(plan)
    assert (labels == np.where(np.arange(SIDE) < SIDE / 2, 0, -1)).all()
    changed = np.where(labels == 0, np.float32(2), values)
    pilots = (flat(each, labels) for each in (values, changed))
    truth, borrowed = (covered(plan, pilots=each).values.reshape(values.shape) for each in pilots)
    column = SIDE // 2
    assert set((borrowed != truth)[:, :, column].ravel().tolist()) == {borrows}
    assert (borrowed[:, :, :column] == 2).all()
    assert (borrowed[:, :, column + 1 :] == truth[:, :, column + 1 :]).all()


def test_of_neighbours_those_beside_a_pixel_come_before_those_at_its_corners() -> None:
    """A sheet's pilot samples: 64 at a corner, then 1 above as well, then 2 at the left too."""
    sheet = (7.4, 7.4), (0.9, 0.0), (0.0, 0.9)
    plan = plan_of(picture(rectangle(*at(sheet))))
    values = np.zeros((3, SIDE, SIDE), dtype=np.float32)
    labels = np.full((SIDE, SIDE), -1, dtype=np.int32)
    share = shares_of(plan, 13, sheet).reshape(SIDE, SIDE)[8, 8]
    assert 0 < share < 1
    shown = []
    for row, column, value in ((7, 7, 64), (7, 8, 1), (8, 7, 2)):
        labels[row, column], values[:, row, column] = 0, value
        shown.append(covered(plan, pilots=flat(values, labels)).values.reshape(values.shape)[0, 8, 8])
    assert shown == [np.float32(share * value) for value in (64, 1, 1.5)]


SEEDS = 16


def whole_samples(plan: RenderPlan, level: int, size: int) -> tuple[Numbers, Numbers, Numbers]:
    """Means (3, N) of plain samples of all pixels and of those with a control variate, squares (2, N).

    With coverage of some `size` the control is the guide; without, it is the colour of the texture.
    """
    pilots = pilot_samples(plan)
    around, want = surroundings(whole(plan), *pilots), np.full((plan.height, plan.width), level, np.uint8)
    none = np.zeros_like(want)
    plain = render_samples(plan, TileRequest(whole(plan), LevelRequest.first(want)))
    levels = LevelRequest(none + np.uint8(PREVIEWED), want, none, none + np.uint8(size))
    found = render_samples(plan, TileRequest(whole(plan), levels, around))
    known = found.known if size else pilots[0].reshape(3, -1) * found.controlled
    both = plain.halves.mean(axis=0, dtype=np.float64), known + found.halves.mean(axis=0, dtype=np.float64)
    return *both, np.array([plain.squares, found.squares])


def of_seeds(document: Json, level: int, size: int) -> tuple[Numbers, Numbers]:
    """Differences (seeds, 3, N) of controlled samples from plain ones, and squares (2, N) of both."""
    plans = [plan_of({**document, "sampling": {**document["sampling"], "seed": s}}) for s in range(SEEDS)]
    found = [whole_samples(plan, level, size) for plan in plans]
    squares: Numbers = np.mean([each[2] for each in found], axis=0)
    return np.array([controlled - plain for plain, controlled, _ in found]), squares


def squared_bias(differences: Numbers) -> tuple[float, float]:
    """Mean over pixels of the squared bias of differences (seeds, 3, N), unbiased, and its standard error.

    Products of different seeds have the squared bias as their mean: the squared sum less the sum of squares.
    """
    pairs = differences.sum(axis=0) ** 2 - (differences**2).sum(axis=0)
    each = pairs.mean(axis=0) / (len(differences) * (len(differences) - 1))
    return float(each.mean()), float(each.std() / np.sqrt(each.size))


STRIP = (1.2, 7.05), (13.0, 0.2), (0.0, 0.1)
"""No pilot sample hits it."""

WALL = (-1.0, -1.0), (SIDE + 2.0, 0.0), (0.0, SIDE + 2.0)


@pytest.mark.parametrize("fine", [{}, {"mirror": 0.3}], ids=["plain", "fine"])
def test_what_is_known_and_the_differences_from_the_guide_are_samples_without_bias(fine: Json) -> None:
    """Over 16 seeds no squared bias within 4 standard errors, which shows one of a hundredth of the contrast.

    Samples vary far less, for what differs at borders is mostly what is seen; still less where only a pixel's
    own pilot sample shows a shape.
    """
    slanted = rectangle(*at(((3.3, 2.1), (9.7, 3.2), (-2.4, 8.6))))
    materials = {"plain": phong([0.75, 0.5, 0.125], ambient=1, diffuse=0.2, **fine)}
    light = bulb([2, 1, 6], [4, 4, 4])
    document = picture(slanted, rectangle(*at(STRIP)), materials=materials, lights=[light])
    differences, (plain, controlled) = of_seeds(document, SAMPLED + 4, 9)
    mixed = np.flatnonzero(plain > 0.01 * plain.max())
    bias, error = squared_bias(differences[:, :, mixed])
    assert abs(bias) <= 4 * error
    assert 4 * error <= (0.6 / 100) ** 2
    assert controlled[mixed].sum() < plain[mixed].sum() / (1 if fine else 4)


def on_a_board(*shapes: Json, **material: object) -> Json:
    """A board across the whole picture, seen straight on, lit by a bulb; fields end inside pixels."""
    board = {"type": "checker", "even": [0.75, 0.5, 0.25], "odd": [0.0, 0.1, 0.2], "repeat": [7.3, 9.1]}
    materials = {"plain": phong(color_texture="board", ambient=0.3, **material), "other": phong()}
    return picture(
        rectangle(*at(WALL)),
        *shapes,
        materials=materials,
        textures={"board": board},
        lights=[bulb([2, 1, 6], [1, 1, 1])],
    )


@pytest.mark.parametrize(
    ("material", "most"), [({}, 1 / 100), ({"specular": 0.5, "shininess": 2}, 1)], ids=["matt", "gloss"]
)
def test_means_of_boards_and_the_differences_from_their_colours_are_samples_without_bias(
    material: Json, most: float
) -> None:
    """Where fields are black and glossy, too: their light is not their colour's, which saves less."""
    differences, (plain, controlled) = of_seeds(on_a_board(**material), SAMPLED + 3, 0)
    bias, error = squared_bias(differences)
    assert abs(bias) <= 4 * error
    assert 4 * error <= (0.75 / 100) ** 2
    assert controlled.sum() < plain.sum() * most


def test_what_hides_a_board_unseen_by_pilot_samples_biases_its_pixels_by_no_more_than_its_share() -> None:
    """The colour behind it is not known, so that the mean stands for it: they are apart by no more than the
    fields are. Pixels that nothing hides have no bias. Pictures cover such pixels with rays instead, as they
    know of edges and of thin shapes.
    """
    corner, along, down = at(STRIP)
    hiding = rectangle([corner[0], corner[1], 1 / 8], along, down, material="other")
    document = on_a_board(hiding)
    plan = plan_of(document)
    assert (pilot_samples(plan)[1] == 0).all()
    differences, _ = of_seeds(document, SAMPLED + 3, 0)
    bare = flat_share(plan) == 0
    assert 0 < bare.sum() < bare.size
    bias, error = squared_bias(differences[:, :, bare])
    assert abs(bias) <= 4 * error
    light = (pilot_samples(plan)[0].reshape(3, -1)).max()
    means = np.abs(differences.mean(axis=0)).max(axis=0)
    errors = differences.std(axis=0, ddof=1).max(axis=0) / np.sqrt(SEEDS)
    assert (means <= flat_share(plan) * light + 5 * errors)[~bare].all()
    marked = np.zeros(bare.shape, bool)
    columns, rows = adaptive_part(plan).edges
    marked[rows * SIDE + columns] = True
    assert marked[~bare].all()


def flat_share(plan: RenderPlan) -> Numbers:
    """Share (N,) of each pixel that a strip just before the board may hide, a little enlarged."""
    (x, y), (width, _), (_, height) = STRIP
    columns, rows = pixels_of(plan)
    across = np.clip(np.minimum(columns + 1, x + width + 0.2) - np.maximum(columns, x - 0.2), 0, 1)
    along = np.clip(np.minimum(rows + 1, y + height + 0.05) - np.maximum(rows, y - 0.05), 0, 1)
    shares: Numbers = across * along
    return shares
