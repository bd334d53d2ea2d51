"""Pictures through a lens in target quality: fewer samples, no worse, and the same for any tiles."""

from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import lamp, phong, rectangle, scene, sphere
from renderer.adaptive.adaptive_render import AdaptiveRender, attempt
from renderer.adaptive.between import ACROSS, ALONG, NODE
from renderer.adaptive.blur import missing_nodes, noise, update
from renderer.adaptive.driver import Driver
from renderer.adaptive.estimate import Estimate
from renderer.adaptive.states import State
from schemas.quality import TargetQuality

SIDE = 64


def through(radius: float, *shapes: dict[str, Any], **more: Any) -> dict[str, Any]:
    """A scene of spheres on a floor, through a lens in focus at a distance of 6."""
    view = {
        "position": [0, 1.2, 6],
        "look_at": [0, 0.8, 0],
        "vertical_fov": 40,
        "lens_radius": radius,
        "focus_distance": 6,
        "width": SIDE,
        "height": SIDE,
    }
    floor = rectangle([-15, 0, 11], [30, 0, 0], [0, 0, -30])
    parts = shapes or (sphere([-0.9, 0.7, 2.5], 0.7), sphere([0.8, 0.8, -3], 0.8))
    materials = {"plain": phong(color=[0.7, 0.5, 0.3])}
    return (
        scene(floor, *parts, camera=view, lights=[lamp([1, 5, 4], [2, 0, 0], [0, 0, 2])], materials=materials)
        | more
    )


def plan_of(document: dict[str, Any], error: float) -> renderer.RenderPlan:
    return renderer.compile_scene(document, TargetQuality(mode="target", error=error))


def stepped(plan: renderer.RenderPlan, tile_size: int | None = None) -> AdaptiveRender:
    """An estimate before its first pass."""
    return AdaptiveRender(Driver.begin(plan, tile_size=tile_size))


def lattice(plan: renderer.RenderPlan) -> Estimate:
    """The picture when its lattice is as fine as it gets."""
    render = stepped(plan)
    while render.estimate.stride > 1:
        assert render.step(lambda requests: ((request, attempt(plan, request)) for request in requests))
    return render.estimate


def test_what_is_out_of_focus_needs_fewer_nodes_beyond_those_of_the_first_lattice() -> None:
    blurred = lattice(plan_of(through(0.6), 4 / 255))
    sharp = lattice(plan_of(through(0.01), 4 / 255))
    first = 1 / 4
    assert first < blurred.shown.mean() < (sharp.shown.mean() + first) / 2


def test_samples_of_nodes_are_shown_and_the_rest_is_interpolated_between_them() -> None:
    estimate = lattice(plan_of(through(0.3), 4 / 255))
    update(estimate)
    assert np.array_equal(estimate.shown, estimate.ways == NODE)
    between = ~estimate.shown
    assert between.mean() > 0.3
    rows, columns = np.nonzero(between)
    inside = (rows > 0) & (rows < SIDE - 1)
    around = np.stack([estimate.values[:, rows[inside] + by, columns[inside]] for by in (-1, 0, 1)])
    assert (around[1] > 0).all()
    assert (np.abs(around[1] - around.mean(axis=0)) < 0.3).all()


def test_noise_between_nodes_is_less_than_that_of_nodes() -> None:
    estimate = lattice(plan_of(through(0.3), 4 / 255))
    update(estimate)
    found = noise(estimate)
    sampled = estimate.shown & (estimate.have > 0)
    apart = np.clip(estimate.halves[0], 0, 1) - np.clip(estimate.halves[1], 0, 1)
    assert found[sampled].sum() == pytest.approx((apart**2).mean(axis=0)[sampled].sum() / 4)
    assert found[~estimate.shown].max() <= 0.56 * found[sampled].max()


def test_no_node_is_missing_where_interpolation_may_err_by_anything() -> None:
    estimate = lattice(plan_of(through(0.3), 4 / 255))
    update(estimate)
    assert not missing_nodes(estimate, 1.0).any()
    assert missing_nodes(estimate, 0.0).any()
    assert not (missing_nodes(estimate, 0.0) & estimate.shown).any()


@pytest.mark.parametrize("axis", [ALONG, ACROSS])
def test_a_pixel_unlike_both_samples_beside_it_is_missing_however_straight_its_own_axis_is(axis: int) -> None:
    estimate = lattice(plan_of(through(0.3), 4 / 255))
    update(estimate)
    ways, shown = (part if axis == ALONG else part.T for part in (estimate.ways, estimate.shown))
    values = estimate.values if axis == ALONG else estimate.values.transpose(0, 2, 1)
    ways[33, 30:33], shown[33, 30:33] = [NODE, axis, NODE], [True, False, True]
    values[:, 33, [30, 32]] = 0.3, 0.5
    for value, is_missing in ((0.31, False), (0.49, False), (0.2, True), (0.6, True)):
        values[:, 33, 31] = value
        missing = missing_nodes(estimate, 0.02)
        assert (missing if axis == ALONG else missing.T)[33, 31] == is_missing
    assert not missing_nodes(estimate, 0.1).any()


def test_the_first_probes_lie_between_nodes_as_often_as_their_probability_says() -> None:
    plan = plan_of(through(0.3), 4 / 255)
    render = stepped(plan)
    while render.estimate.state is State.LATTICE:
        assert render.step(lambda requests: ((request, attempt(plan, request)) for request in requests))
    estimate = render.estimate
    assert estimate.state is State.PROBES
    wanted = estimate.want > estimate.have
    probabilities = estimate.probe_probability[estimate.strata[~estimate.shown]]
    assert not wanted[estimate.shown].any()
    deviation = np.sqrt((probabilities * (1 - probabilities)).sum())
    assert abs(wanted.sum() - probabilities.sum()) <= 4 * deviation < probabilities.sum()


@pytest.mark.parametrize("tile_size", [16, 23])
def test_a_picture_through_a_lens_does_not_depend_on_tiles(tile_size: int) -> None:
    plan = plan_of(through(0.3), 4 / 255)
    assert np.array_equal(
        renderer.render(plan).image, renderer.render(plan, tile_size=tile_size, workers=1).image
    )


def test_a_picture_whose_time_is_over_after_its_first_lattice_says_that_little_is_known() -> None:
    plan = renderer.compile_scene(through(0.3), TargetQuality(mode="target", error=1 / 255, time_limit=1e-3))
    result = renderer.render(plan)
    assert np.isfinite(result.image).all()
    assert (result.image > 0).any(axis=2).mean() > 0.99
    assert result.report["error"]["high"] > 4 / 255
