"""Pilot samples on a lattice, and where the picture between them is interpolated."""

import numpy as np
import pytest
from numpy.typing import NDArray

from renderer.adaptive.lattice import COARSEST, ENOUGH, cells_of, fill, stride_for

SIZES = [(1, 1), (1, 2), (1, 40), (33, 1), (2, 2), (3, 3), (5, 9), (6, 11), (9, 17), (16, 24)]

Field = NDArray[np.float32]


def nodes(height: int, width: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rows and columns of a lattice; its even ones are those of the coarser lattice."""
    y, x = np.meshgrid(np.arange(height) / 1.0, np.arange(width) / 1.0, indexing="ij")
    return y, x


def colored(*channels: NDArray[np.float64]) -> Field:
    return np.stack(channels).astype(np.float32)


def filled(
    truth: Field,
    allowed: float,
    labels: NDArray[np.int32] | None = None,
    needs_sampling: NDArray[np.bool_] | None = None,
) -> tuple[Field, NDArray[np.int32], NDArray[np.bool_]]:
    """Values, labels, and what must be sampled, where only the even nodes are known."""
    size = truth.shape[1:]
    labels = np.zeros(size, np.int32) if labels is None else labels
    needs_sampling = np.zeros(size, bool) if needs_sampling is None else needs_sampling
    even = np.s_[::2, ::2]
    values, marks = np.full(truth.shape, np.nan, np.float32), np.full(size, -99, np.int32)
    values[:, *even], marks[even] = truth[:, *even], labels[even]
    cells = cells_of(values[:, *even], marks[even], needs_sampling[even], allowed)
    unknown = fill(values, marks, cells)
    assert not unknown[even].any()
    assert np.isnan(values[:, unknown]).all()
    assert np.isfinite(values[:, ~unknown]).all()
    return values, marks, unknown


def between(height: int, width: int) -> NDArray[np.bool_]:
    """Nodes (H, W) that have known ones on both sides, where four or more in a square are known."""
    y, x = nodes(height, width)
    if min(height, width) < 3:
        return (x % 2 == 0) & (y % 2 == 0)
    return (x <= (width - 1) // 2 * 2) & (y <= (height - 1) // 2 * 2)


@pytest.mark.parametrize("size", SIZES)
def test_planes_are_interpolated_exactly(size: tuple[int, int]) -> None:
    y, x = nodes(*size)
    truth = colored(3 * x - 5 * y, x / 8 + y / 4, 7 + 0 * x)
    values, marks, unknown = filled(truth, allowed=0.0)
    assert (values[:, ~unknown] == truth[:, ~unknown]).all()
    assert (marks[~unknown] == 0).all()
    if min(size) >= 5:
        assert (unknown == ~between(*size)).all()


@pytest.mark.parametrize("size", [(1, 17), (17, 1), (2, 17), (17, 2), (4, 17), (17, 4)])
def test_where_there_are_too_few_rows_all_is_sampled(size: tuple[int, int]) -> None:
    """Two nodes on a line say nothing of what is between them, nor does a line of its neighbours."""
    y, x = nodes(*size)
    _, _, unknown = filled(colored(x, y, x), allowed=1.0)
    assert (unknown == ((x % 2 == 1) | (y % 2 == 1))).all()


@pytest.mark.parametrize("size", [(1, 33), (33, 1), (9, 33), (33, 9)])
@pytest.mark.parametrize("place", [6.5, 7.5, 15.5, 16.5])
def test_nothing_is_interpolated_across_a_step(size: tuple[int, int], place: float) -> None:
    y, x = nodes(*size)
    step = ((x if size[1] > size[0] else y) > place) / 1.0
    truth = colored(0 * x, step, 0 * x)
    values, _, unknown = filled(truth, allowed=1 / 8 - 2.0**-20)
    assert (values[:, ~unknown] == truth[:, ~unknown]).all()
    far = np.abs((x if size[1] > size[0] else y) - place) > 4
    assert not unknown[between(*size) & far].any()


@pytest.mark.parametrize("cut", range(5, 28))
def test_shapes_are_interpolated_up_to_their_border_and_never_across(cut: int) -> None:
    y, x = nodes(9, 33)
    labels = (x >= cut).astype(np.int32)
    truth = colored(np.where(labels, 9 - x, x), 2 * y + 5 * labels, x + y)
    values, marks, unknown = filled(truth, 0.0, labels)
    left, right = (cut - 1) // 2 * 2, (cut + 1) // 2 * 2
    assert (unknown == ((x >= left) & (x <= right) & ((x % 2 == 1) | (y % 2 == 1)))).all()
    assert (values[:, ~unknown] == truth[:, ~unknown]).all()
    assert (marks[~unknown] == labels[~unknown]).all()


@pytest.mark.parametrize("across", [True, False])
def test_a_strip_of_two_nodes_of_a_shape_is_sampled(across: bool) -> None:
    """It has no second difference of its own, and those of its neighbours are not about it."""
    y, x = nodes(17, 17)
    along = x if across else y
    labels = ((along >= 8) & (along <= 11)).astype(np.int32)
    _, _, unknown = filled(colored(x, x, y), 1.0, labels)
    assert unknown[(labels == 1) & (along == 9)].all()


def test_one_node_with_something_fine_keeps_its_four_cells_from_being_interpolated() -> None:
    y, x = nodes(17, 17)
    needs_sampling = (x == 8) & (y == 6)
    _, _, unknown = filled(colored(x, y, x), 1.0, needs_sampling=needs_sampling)
    odd = (x % 2 == 1) | (y % 2 == 1)
    assert (unknown == (odd & (np.abs(x - 8) <= 2) & (np.abs(y - 6) <= 2))).all()


def test_a_single_pixel_that_differs_keeps_all_cells_around_it_from_being_interpolated() -> None:
    """Its second difference, and those of its neighbours in row and column, say so."""
    y, x = nodes(21, 21)
    odd_one = (x == 10) & (y == 10)
    _, _, unknown = filled(colored(0 * x, odd_one / 1.0, 0 * x), np.nextafter(1 / 8, 0))
    near = (np.abs(x - 10) + np.abs(y - 10) <= 3) & ((x % 2 == 1) | (y % 2 == 1))
    assert unknown[near].all()


@pytest.mark.parametrize(("bend_x", "bend_y"), [(1, 0), (0, 1), (-2, 1), (1, 2), (3, -3)])
def test_a_quadratic_is_interpolated_if_its_error_is_allowed_and_else_sampled(
    bend_x: int, bend_y: int
) -> None:
    """In steps of the coarse lattice b x x / 2 has second differences b; the chord is b / 8 above it."""
    y, x = nodes(17, 33)
    truth = colored(0 * x, bend_x * x * x / 8 + bend_y * y * y / 8 + x * y, x)
    error = (abs(bend_x) + abs(bend_y)) / 8
    values, _, unknown = filled(truth, allowed=error)
    assert not unknown.any()
    assert abs(np.abs(values - truth).max() - abs(bend_x + bend_y) / 8) <= abs(bend_x - bend_y) / 8
    assert np.abs(values - truth).max() <= error
    _, _, unknown = filled(truth, allowed=np.nextafter(error, 0))
    assert (unknown == ((x % 2 == 1) | (y % 2 == 1))).all()


@pytest.mark.parametrize("seed", range(12))
def test_no_quadratic_is_interpolated_with_more_error_than_allowed(seed: int) -> None:
    """Any signs, any channels, borders between shapes of different ones; float32 rounds values below 64."""
    random = np.random.default_rng(seed)
    y, x = nodes(*random.integers(5, 34, 2).tolist())
    labels = (random.normal() * (x - 9) > random.normal() * (y - 8)).astype(np.int32)
    forms = random.normal(size=(2, 3, 6)) * [1 / 64, 1 / 64, 1 / 64, 1, 1, 1]
    terms = np.stack((x * x, x * y, y * y, x, y, np.ones_like(x)))
    truth = np.choose(labels, np.einsum("kcf,fyx->kcyx", forms, terms)).astype(np.float32)
    assert np.abs(truth).max() < 128
    for allowed in (1e-3, 4e-3, 1e-2, 3e-2):
        values, marks, unknown = filled(truth, allowed, labels)
        same = ~unknown & (marks == labels)
        assert np.abs(values - truth)[:, same].max() <= allowed + 8 * 2.0**-24 * 128


@pytest.mark.parametrize(
    ("width", "height"),
    [(1, 1), (1, 4000), (160, 120), (320, 240), (400, 200), (640, 360), (1024, 512), (3840, 2160)],
)
def test_a_lattice_begins_with_enough_pilot_samples_and_is_no_coarser_than_the_coarsest(
    width: int, height: int
) -> None:
    """Each halving takes four times the samples, so some power of two is within a factor of two of enough."""
    stride = stride_for(width, height)
    assert stride in (1, 2, 4, 8)
    pilots = width * height / stride**2
    assert stride == 1 or pilots >= ENOUGH / 2
    assert stride == COARSEST or pilots <= ENOUGH * 2
    assert stride_for(height, width) == stride
