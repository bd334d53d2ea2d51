"""Estimates from samples: merged over passes, unbiased, and never interpolated across a border."""

import numpy as np
import pytest

import renderer
from renderer.adaptive import Estimate, render_samples
from renderer.adaptive.error_statistics import error_statistics, pilot_errors
from renderer.adaptive.guides import surroundings
from renderer.adaptive.lattice import (
    NODE,
    interpolate_labels_once,
    interpolate_once,
    interpolation_axes,
    interpolation_errors,
)
from renderer.adaptive.levels import COUNTS, SAMPLED
from renderer.adaptive.requests import TileRequest
from renderer.adaptive.strata import COUNT, stratum_statistics
from schemas.quality import TargetQuality
from schemas.tiles import Tile
from tests.pictures import pictures


def sampled(*levels: int) -> Estimate:
    """All pixels of the room after passes that bring them to these levels."""
    plan = renderer.compile_scene(pictures.of_room(), TargetQuality(mode="target", error=4 / 255))
    estimate = Estimate.begin(plan)
    height, width = estimate.have.shape
    tile = Tile(0, 0, 0, width, height)
    for level in levels:
        estimate.want[...], estimate.cover[...] = level, 0
        around = surroundings(tile, estimate.around)
        estimate.take(tile, render_samples(plan, TileRequest(tile, estimate.requested.part(tile), around)))
    return estimate


def test_samples_of_two_passes_are_those_of_one() -> None:
    """But for rounding to float32 between the passes; the second brings most of the samples."""
    assert COUNTS[SAMPLED + 3] >= 4 * COUNTS[SAMPLED]
    two, one = sampled(SAMPLED, SAMPLED + 3), sampled(SAMPLED + 3)
    assert np.abs(two.halves - one.halves).max() <= 4 * 2.0**-23 * one.halves.max()
    np.testing.assert_allclose(two.squares, one.squares, rtol=1e-3, atol=1e-5 * one.squares.max())


def test_errors_of_borders_and_of_other_pixels_are_measured_apart() -> None:
    """All samples scatter alike; the halves differ much at borders, and little elsewhere."""
    estimate = sampled(SAMPLED)
    border = np.indices(estimate.have.shape)[1] < 5
    estimate.coverage[border], estimate.shown[...], estimate.squares[...] = 1, True, 1.0
    apart = np.where(border, 0.2, 0.01)
    estimate.halves[...] = 0.5 + np.multiply.outer([0.5, -0.5], np.broadcast_to(apart, (3, *apart.shape)))
    squares = error_statistics(estimate).squares
    np.testing.assert_allclose(squares, (apart**2 / 4).ravel(), rtol=1e-12)


@pytest.mark.parametrize("noise", [0.01, 0.1])
@pytest.mark.parametrize("error", [0.0, 0.05])
def test_error_of_a_pilot_sample_is_unbiased(noise: float, error: float) -> None:
    """(a - v)(b - v) has the variance 2 e e s s + s**4; the mean of 200,000 is within 5 deviations."""
    count = 200_000
    halves = 0.5 + noise * np.random.default_rng(5).uniform(-(3**0.5), 3**0.5, (2, 1, count)).repeat(
        3, axis=1
    )
    errors, _ = pilot_errors(halves, np.full((3, count), 0.5 + error, np.float32))
    deviation = np.sqrt((2 * error**2 * noise**2 + noise**4) / count)
    assert abs(errors.mean() - error**2) <= 5 * deviation


def test_stratum_without_a_probe_is_not_taken_for_exact() -> None:
    """Probes of one stratum find no error; pixels of another have none: their error is unknown, not 0."""
    probes = np.full(50, 7)
    sizes = np.bincount([7, 60], [400, 300], COUNT).astype(np.int64)
    found = stratum_statistics(probes, sizes, np.zeros(50), np.zeros(50), np.zeros(50))
    assert found.errors[7] == 0
    assert found.errors[60] > 0
    assert found.uncertain[60] > 0


@pytest.mark.parametrize("across", [False, True])
@pytest.mark.parametrize("cut", range(5, 28))
def test_pilot_samples_are_interpolated_up_to_a_border(cut: int, across: bool) -> None:
    """Two linear ramps that meet at a border: even nodes are known, and no other value mixes the two."""
    place = np.arange(33)
    label, ramp = (place >= cut).astype(np.int32), np.where(place >= cut, 9 - place, place)
    shape = (33, 9) if across else (9, 33)
    labels = np.broadcast_to(label[:, None] if across else label, shape)
    truth = np.broadcast_to(ramp[:, None] if across else ramp, (3, *shape)).astype(np.float32)
    even = np.s_[::2, ::2]
    values, marks = np.full((3, *shape), np.nan, np.float32), np.full(shape, -99, np.int32)
    values[:, *even], marks[even] = truth[:, *even], labels[even]
    axes = interpolation_axes(*interpolation_errors(values[:, *even], marks[even]), marks[even], shape, 0.0)
    interpolate_once(values, axes)
    interpolate_labels_once(marks, axes)
    unknown = axes == NODE
    unknown[even] = False
    assert 0 < unknown.sum() < unknown.size / 2
    assert (values[:, ~unknown] == truth[:, ~unknown]).all()
    assert (marks[~unknown] == labels[~unknown]).all()
