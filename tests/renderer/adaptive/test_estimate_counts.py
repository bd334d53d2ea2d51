"""Camera rays that a picture has taken, and that its next pass will take."""

import numpy as np
import pytest

from renderer.adaptive.levels import COVERAGES, COVERED, PREVIEWED, SAMPLED
from tests.renderer.adaptive.test_estimate import begun, found, passes, plan_of, rising, taken, whole


def rays_at(level: int, coverage: int) -> int:
    """Camera rays of what a pixel shows at some level and coverage."""
    samples = {0: 0, PREVIEWED: 1, COVERED: 0}.get(level, 2 ** (level - 1))
    return samples + 2 * (0, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233, 377, 610, 987)[coverage]


def pairs(*maps: np.ndarray) -> list[tuple[int, ...]]:
    """Numbers of each pixel, row by row."""
    return list(zip(*(map_.ravel().tolist() for map_ in maps), strict=True))


def test_a_picture_counts_one_sample_for_each_pilot_sample_and_none_in_between() -> None:
    """At borders it counts the rays of both lattices as well."""
    estimate, _ = taken(rising())
    levels = pairs(estimate.have, estimate.coverage)
    assert estimate.counts().ravel().tolist() == [rays_at(*each) for each in levels]


def test_the_rays_of_the_next_pass_are_those_that_pixels_lack() -> None:
    """Pilot samples are of no use to samples, nor a lattice to a larger one; samples are to more samples."""
    estimate = begun(plan_of())
    random = np.random.default_rng(6)
    estimate.have[...], estimate.want[...] = random.integers(0, 9, (2, 16, 24))
    estimate.want[estimate.want == COVERED] = 0
    estimate.coverage[...], estimate.cover[...] = random.integers(0, 12, (2, 16, 24))
    expected = 0
    for have, want, coverage, cover in pairs(*estimate.requested.stacked()):
        if want > have:
            expected += rays_at(want, 0) - (rays_at(have, 0) if have >= SAMPLED else 0)
        if cover > coverage:
            expected += rays_at(0, cover)
    assert estimate.rays_wanted() == expected
    assert estimate.rays_in_cells(5).sum() == expected
    estimate.want[...], estimate.cover[...] = estimate.have, estimate.coverage
    assert estimate.rays_wanted() == 0


@pytest.mark.parametrize("number", range(3))
def test_a_pass_sends_the_rays_that_were_predicted(number: int) -> None:
    """At borders each ray may hit what no pilot sample has hit, and then that is shaded."""
    estimate = begun(plan_of())
    passes(estimate, (0, 2, 3)[number])
    wanted, rays = estimate.rays_wanted(), COVERAGES[estimate.cover[estimate.requested.covered]].sum()
    assert wanted > 0
    assert number == 2 or rays == 0
    assert wanted <= found(estimate, whole(estimate)).counts["camera"] <= wanted + rays
