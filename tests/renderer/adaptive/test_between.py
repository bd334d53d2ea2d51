"""What lies between the nodes of a lattice, against bilinear interpolation and against closed forms."""

import numpy as np
import pytest

from renderer.adaptive.between import ACROSS, ALONG, NODE, bends, interpolate, ways_between, weights


def everywhere(height: int, width: int, stride: int) -> np.ndarray:
    """Ways of a picture whose nodes are `stride` apart and all of which is interpolated."""
    ways = np.full((height, width), NODE, dtype=np.uint8)
    nothing = np.zeros((height, width), dtype=np.float32)
    while stride > 1:
        finer = np.s_[:: stride // 2, :: stride // 2]
        coarse = nothing[::stride, ::stride]
        found = ways_between(coarse, coarse, ways[finer].shape, 0.0)
        found[::2, ::2] = ways[::stride, ::stride]
        ways[finer] = found
        stride //= 2
    return ways


@pytest.mark.parametrize("stride", [2, 4, 8])
def test_a_bilinear_picture_is_interpolated_exactly(stride: int) -> None:
    rows, columns = np.indices((33, 41)).astype(float)
    picture = np.stack([rows * columns, 2 * rows - columns, np.ones_like(rows)])
    seen = picture.copy()
    between = everywhere(33, 41, stride) != NODE
    seen[:, between] = np.nan
    interpolate(seen, everywhere(33, 41, stride))
    assert between.mean() > 0.7
    np.testing.assert_allclose(seen, picture, rtol=1e-14)


def test_pixels_beyond_the_last_node_of_a_row_are_nodes() -> None:
    ways = everywhere(8, 8, 4)
    # Node 4 has no neighbour at 8, so that 6 is sampled, and 7 for the same reason; 5 lies between 4 and 6.
    assert ways[0].tolist() == [NODE, ACROSS, ACROSS, ACROSS, NODE, ACROSS, NODE, NODE]
    assert ways[:, 0].tolist() == [NODE, ALONG, ALONG, ALONG, NODE, ALONG, NODE, NODE]


def test_an_edge_along_rows_needs_nodes_across_it_alone() -> None:
    rows = np.indices((9, 9))[0]
    picture = (rows > 4).astype(np.float32)[None].repeat(3, axis=0)
    across, along = bends(picture)
    assert not across.any()
    assert np.array_equal(along > 0, np.isin(rows, (4, 5)))
    ways = ways_between(across, along, (17, 17), 0.01)
    assert (ways[::2, 1::2] == ACROSS).all()
    assert (ways[9, ::2] == NODE).all()
    assert (ways[1::2, 1::2] == ACROSS).all()
    assert (ways[1, ::2] == ALONG).all()


@pytest.mark.parametrize("curvature", [0.01, 0.3])
def test_bends_of_a_parabola_are_what_linear_interpolation_errs_by(curvature: float) -> None:
    x = np.arange(0, 17, 2, dtype=np.float64)
    nodes = np.broadcast_to((curvature * x * x).astype(np.float32), (3, 2, 9))
    between = (nodes[0, 0, 1:] + nodes[0, 0, :-1]) / 2
    err = between - curvature * (x[:-1] + 1) ** 2
    np.testing.assert_allclose(bends(nodes)[0][0, :8], err, rtol=1e-4)


def test_every_interpolated_pixel_is_answered_for_once_and_by_what_is_left_of_noise() -> None:
    ways = everywhere(33, 33, 8)
    found = weights(ways)
    nodes = ways == NODE
    from_between = (~nodes).sum()
    # Nothing is lost on the way: nodes count for themselves, and together for all that lies between.
    assert (found[nodes].sum() - nodes.sum()) / from_between == pytest.approx(0.55)


def test_a_lattice_of_one_row_or_of_one_node_is_not_interpolated_across_what_is_not_there() -> None:
    for shape in ((1, 1), (1, 5), (5, 1)):
        across, along = bends(np.zeros((3, *shape), dtype=np.float32))
        finer = (2 * shape[0] - 1, 2 * shape[1] - 1)
        ways = ways_between(across, along, finer, 1.0)
        assert (ways[::2, ::2] == NODE).all()
        values = np.ones((3, *finer))
        interpolate(values, ways)
        assert (values == 1).all()
