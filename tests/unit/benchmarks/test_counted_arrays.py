"""The count of element operations is the count that the formula says."""

import numpy as np
import pytest

import renderer
from accuracy.variations import fixed_quality
from benchmarks.counted_arrays import Operation, counting
from scenes import scene_path

PRODUCT = Operation("multiply", "__call__", ("d", "d"))
MOVE = Operation("move", "", ("d",))


def test_every_element_of_a_formula_is_counted_once_by_kind_and_type() -> None:
    with counting() as tally:
        x = np.arange(10.0)
        _ = (2 * x + 1) * np.ones((3, 1))
    assert tally.elements == {
        PRODUCT: 10 + 30,
        Operation("add", "__call__", ("d", "d")): 10,
    }
    assert tally.calls[PRODUCT] == 2


def test_a_sum_counts_what_goes_in_and_writing_into_a_buffer_what_is_written() -> None:
    with counting() as tally:
        x = np.full((4, 5), 2.0, dtype=np.float32)
        room = np.empty((4, 5), dtype=np.float32)
        np.multiply(x, x, out=room)
        total = room.sum(axis=0)
    assert tally.elements == {
        Operation("multiply", "__call__", ("f", "f")): 20,
        Operation("add", "reduce", ("f",)): 20,
    }
    assert total.tolist() == [16.0] * 5


@pytest.mark.parametrize(
    ("act", "moved"),
    [
        (lambda x: x[2:5], 0),
        (lambda x: x.reshape(2, 5), 0),
        (lambda x: np.broadcast_to(x, (3, 10)), 0),
        (lambda x: x[np.array([7, 1, 7])], 3),
        (lambda x: np.take(x, [0, 1]), 2),
        (lambda x: np.copyto(x[:4], 1.0), 4),
        (lambda x: x.__setitem__(slice(0, 6), 0.0), 6),
        (lambda x: np.concatenate((x, x)), 20),
    ],
    ids=["slice", "reshape", "broadcast", "pick", "take", "copy", "assign", "concatenate"],
)
def test_what_is_copied_is_a_move_and_a_view_is_nothing(act: object, moved: int) -> None:
    assert callable(act)
    with counting() as tally:
        act(np.arange(10.0))
    assert tally.elements[MOVE] == moved
    assert tally.elements.total() == moved


def test_counting_changes_no_pixel() -> None:
    scene = renderer.load_scene(scene_path("gallery/basic")).document
    small = scene.model_copy(update={"camera": scene.camera.model_copy(update={"width": 40, "height": 30})})
    plan = renderer.compile_scene(small, fixed_quality("center", 1, "uniform", 4))
    image = renderer.render(plan).image
    with counting() as tally:
        counted = renderer.render(plan).image
    np.testing.assert_array_equal(np.asarray(counted), image)
    assert tally.elements.total() > 40 * 30
