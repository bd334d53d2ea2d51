"""Control variates: what pilot samples tell of the brightness of what a ray meets."""

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from renderer.adaptive.guides import Nearby, guide, surroundings
from renderer.adaptive.levels import COVERAGES, LOOKED, SAMPLED
from renderer.adaptive.samples import Demanded, render_samples
from renderer.hard_cases.documents import Json, bulb, camera, phong, rectangle
from renderer.plan import RenderPlan
from schemas.quality import TargetQuality
from tests.unit.renderer.adaptive.test_coverage import (
    SIDE,
    at,
    covered,
    first_looks,
    flat,
    picture,
    pixels_of,
    plan_of,
    shares_of,
    whole,
)

Numbers = NDArray[np.float64]


def one(labels: list[int], values: list[float], fine: list[bool] | None = None) -> dict[int, float | None]:
    """Brightness of each label around a pixel, None where none is known."""
    levels = np.repeat(np.array(values, np.float32)[None, :, None], 3, axis=0)
    around = guide(Nearby(levels, np.array(labels, np.int32)[:, None]), np.array(fine or [False] * 4))
    asked = np.array([*sorted(set(labels)), 3], np.int32)
    radiance, known = around.at(asked, np.zeros(asked.size, np.int64))
    assert not radiance[:, ~known].any()
    assert (radiance[0] == radiance[2]).all()
    found = radiance[0].tolist()
    return {
        label: told if met else None
        for label, told, met in zip(asked.tolist(), found, known.tolist(), strict=True)
    }


def test_of_each_label_the_pixels_own_sample_goes_before_those_beside_it_and_these_before_corners() -> None:
    """Row by row: 0 is its own, 1 lies beside it twice and once at a corner, 2 at corners, -1 beside it."""
    labels, values = [2, 1, 2, 0, 0, 1, 1, -1, 2], [1.0, 2, 3, 4, 5, 6, 7, 8, 11]
    assert one(labels, values) == {0: 5, 1: 4, 2: 5, -1: 8, 3: None}


def test_of_fine_shapes_none_but_the_pixels_own_sample_tells() -> None:
    labels, values = [2, 1, 2, 0, 0, 1, 1, -1, 2], [1.0, 2, 3, 4, 5, 6, 7, 8, 11]
    fine = [True, True, False, False]
    assert one(labels, values, fine) == {0: 5, 1: None, 2: 5, -1: 8, 3: None}


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
    values, labels, _ = first_looks(plan)
    assert (labels == np.where(np.arange(SIDE) < SIDE / 2, 0, -1)).all()
    changed = np.where(labels == 0, np.float32(2), values)
    looks = (flat(each, labels) for each in (values, changed))
    truth, told = (covered(plan, looks=each).values.reshape(values.shape) for each in looks)
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
    share = shares_of(plan, 13, sheet).reshape(SIDE, SIDE)[8, 8]
    assert 0 < share < 1
    shown = []
    for row, column, look in ((7, 7, 64), (7, 8, 1), (8, 7, 2)):
        labels[row, column], values[:, row, column] = 0, look
        shown.append(covered(plan, looks=flat(values, labels)).values.reshape(values.shape)[0, 8, 8])
    assert shown == [np.float32(share * told) for told in (64, 1, 1.5)]
