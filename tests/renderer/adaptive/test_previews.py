import numpy as np
import pytest

from renderer.adaptive.levels import COVERED, PREVIEWED, SAMPLED
from renderer.adaptive.requests import LevelRequest
from renderer.adaptive.samples import Samples, preview
from schemas.tiles import Tile


def samples(
    pilots: list[list[float]] | np.ndarray = (),
    halves: np.ndarray | None = None,
    covers: list[list[float]] | np.ndarray = (),
    controlled: list[bool] | None = None,
) -> Samples:
    """Pilot samples (n, 3), covers (k, 3), means of the halves (2, m, 3), and which (m,) are differences."""
    seen, covered = (np.array(each, dtype=np.float32).reshape(-1, 3) for each in (pilots, covers))
    means = np.zeros((2, 0, 3)) if halves is None else halves
    return Samples(
        pilots=seen.T,
        labels=np.zeros(len(seen), np.int32),
        colors=np.ones((3, len(seen)), np.float32),
        residues=np.zeros(len(seen), np.float32),
        covers=covered.T,
        known=covered.T,
        spread=np.zeros(len(covered), np.float32),
        doubts=np.zeros(len(covered), np.float32),
        halves=means.transpose(0, 2, 1).astype(np.float32),
        squares=np.zeros(means.shape[1], np.float32),
        controlled=np.array(controlled or [False] * means.shape[1], dtype=bool),
        counts={},
        work={},
        cpu_seconds=0.0,
    )


def shown(
    tile: Tile,
    found: Samples,
    have: np.ndarray,
    want: np.ndarray,
    before: float = 0.0,
    cover: np.ndarray | None = None,
) -> np.ndarray:
    """The first channel of what is seen."""
    picture = np.full((tile.height, tile.width, 3), before, np.float32)
    nothing = np.zeros_like(have)
    levels = (have, want, nothing, nothing if cover is None else cover)
    return preview(tile, found, LevelRequest(*(map_.astype(np.uint8) for map_ in levels)), picture)[:, :, 0]


def test_pilot_samples_fill_the_squares_of_their_lattice() -> None:
    tile, have = Tile(0, 8, 8, 20, 16), np.zeros((8, 12))
    want = np.zeros((8, 12))
    want[::4, ::4] = PREVIEWED
    pilots = np.arange(6.0).repeat(3).reshape(6, 3)
    wanted = np.arange(6.0).reshape(2, 3).repeat(4, 0).repeat(4, 1)
    assert np.array_equal(shown(tile, samples(pilots), have, want), wanted)


def test_a_lattice_begins_at_the_corner_of_the_picture_wherever_a_tile_does() -> None:
    tile, have = Tile(0, 5, 0, 11, 4), np.zeros((4, 6))
    want = np.zeros((4, 6))
    want[0, 3] = PREVIEWED  # the pixel (8, 0): on a lattice of 8 its square ends beyond the tile
    found = shown(tile, samples([[1, 1, 1]]), have, want, before=0.25)
    assert np.array_equal(found, [[0.25, 0.25, 0.25, 1, 1, 1]] * 4)


def test_pilot_samples_on_a_finer_lattice_leave_the_coarser_one_as_it_was() -> None:
    tile, have = Tile(0, 0, 0, 4, 4), np.zeros((4, 4))
    have[::4, ::4] = PREVIEWED
    want = np.zeros((4, 4))
    want[0, 2] = want[2, 2] = PREVIEWED
    found = shown(tile, samples([[1, 1, 1], [2, 2, 2]]), have, want, before=0.5)
    wanted = [[0.5, 0.5, 1, 1], [0.5, 0.5, 1, 1], [0.5, 0.5, 2, 2], [0.5, 0.5, 2, 2]]
    assert np.array_equal(found, wanted)


@pytest.mark.parametrize(
    ("have", "value"),
    [(0, 0.75), (PREVIEWED, 0.75), (COVERED, 0.75), (SAMPLED, 0.625)],
    ids=["unseen", "previewed", "covered", "sampled"],
)
def test_samples_take_the_place_of_pilot_samples_and_join_other_samples(have: int, value: float) -> None:
    # Eight samples with a mean of 0.75; four of them new where four were there, with a mean of 0.5.
    halves = np.array([[[0.5] * 3], [[1.0] * 3]])
    levels = np.full((1, 1), have), np.full((1, 1), SAMPLED + 1)
    assert shown(Tile(0, 0, 0, 1, 1), samples(halves=halves), *levels, before=0.5) == value


def test_pixels_of_which_nothing_is_wanted_stay() -> None:
    tile, have, want = Tile(0, 0, 0, 2, 1), np.array([[SAMPLED + 1, SAMPLED]]), np.array([[0, SAMPLED + 1]])
    halves = np.ones((2, 1, 3))
    assert np.array_equal(shown(tile, samples(halves=halves), have, want), [[0.0, 0.5]])


def test_pixels_at_borders_take_the_place_of_their_pilot_samples_and_leave_the_others() -> None:
    tile, have = Tile(0, 0, 0, 3, 2), np.array([[PREVIEWED, PREVIEWED, 0], [PREVIEWED, COVERED, PREVIEWED]])
    cover = np.array([[0, 1, 5], [2, 0, 0]])
    covers = samples(covers=[[1, 1, 1], [2, 2, 2], [3, 3, 3]])
    found = shown(tile, covers, have, np.zeros((2, 3)), before=0.5, cover=cover)
    assert np.array_equal(found, [[0.5, 1, 2], [3, 0.5, 0.5]])


def test_a_pixel_with_samples_keeps_what_it_shows_when_its_border_is_covered_again() -> None:
    have, cover = np.array([[SAMPLED, COVERED]]), np.array([[3, 3]])
    covers = samples(covers=[[1, 1, 1], [2, 2, 2]])
    found = shown(Tile(0, 0, 0, 2, 1), covers, have, np.zeros((1, 2)), before=0.5, cover=cover)
    assert np.array_equal(found, [[0.5, 2]])


def test_differences_from_a_control_variate_are_not_seen_before_their_pass_is_merged() -> None:
    """They are near 0, whatever the pixel shows."""
    tile, have, want = (
        Tile(0, 0, 0, 3, 1),
        np.array([[SAMPLED, COVERED, PREVIEWED]]),
        np.full((1, 3), SAMPLED + 1),
    )
    found = samples(halves=np.ones((2, 3, 3)), controlled=[True, False, True])
    assert np.array_equal(shown(tile, found, have, want, before=0.25), [[0.25, 1, 0.25]])
