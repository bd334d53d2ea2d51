"""Quotes as a whole."""

from __future__ import annotations

import pytest

import renderer
from accuracy.quotes import quote
from accuracy.variations import variants
from renderer.scenes import LoadedScene
from schemas.api.plans import Offer, Quote
from schemas.quality import Antialiasing, FixedQuality, LightSampling, TargetQuality
from tests.accuracy.quotes.conftest import edge

LONG = 30.0
"""Seconds in which a small picture is known in all respects."""


@pytest.fixture(scope="module")
def quoted() -> Quote:
    scene = renderer.load_scene(edge(48, 40, antialiasing={"pattern": "rotated", "samples": 9}))
    return quote(scene, target_error=0.01, seconds=5.0, workers=2, limit=LONG)


def fixed(offer: Offer) -> FixedQuality:
    assert isinstance(offer.quality, FixedQuality)
    return offer.quality


def test_both_ladders_and_target_errors_are_offered(quoted: Quote) -> None:
    own, sobol, targets = [], [], []
    for offer in quoted.offers:
        if isinstance(offer.quality, TargetQuality):
            targets.append(offer.quality.error)
        else:
            assert offer.quality.antialiasing is not None
            ladder = own if offer.quality.antialiasing.pattern == "rotated" else sobol
            ladder.append(offer.quality.antialiasing.samples)
    assert own == [1, 4, 9, 16, 64, 256]
    assert sobol == [1, 4, 16, 64, 256]
    assert targets == [4 / 255, 0.01, 2 / 255, 1 / 255]


def test_what_the_scene_requests_is_among_the_offers(quoted: Quote) -> None:
    assert quoted.asked in quoted.offers
    assert quoted.asked is not None
    assert fixed(quoted.asked).antialiasing == Antialiasing(pattern="rotated", samples=9)


def test_every_interval_holds_its_estimate(quoted: Quote) -> None:
    for offer in quoted.offers:
        for known in (offer.cpu_seconds, offer.seconds, offer.error):
            assert known is None or 0 <= known.low <= known.estimate <= known.high


def test_workers_share_the_cpu_seconds_of_fixed_samples(quoted: Quote) -> None:
    for offer in quoted.offers:
        if isinstance(offer.quality, FixedQuality):
            assert offer.seconds.estimate == pytest.approx(offer.cpu_seconds.estimate / 2)


def test_the_requested_error_is_kept_and_the_given_time_too(quoted: Quote) -> None:
    assert quoted.for_error is not None
    assert quoted.for_error.error is not None
    assert quoted.for_error.error.estimate <= 0.01
    assert quoted.for_seconds is not None
    assert quoted.for_seconds.seconds.estimate <= 5.0 * (1 + 1e-9)


def test_the_price_is_that_of_the_plan(ball_scene: LoadedScene) -> None:
    quality = FixedQuality(mode="fixed", light=LightSampling(pattern="uniform", samples=64))
    plan = renderer.compile_scene(ball_scene, quality)
    assert quote(ball_scene, quality, limit=0.0).price == plan.describe().cost


def test_each_effect_comes_with_its_origin_most_costly_first(ball_scene: LoadedScene) -> None:
    quoted = quote(ball_scene, limit=LONG)
    expected = {each.effect: each.pointers for each in variants(ball_scene.document)}
    del expected["antialiasing"]
    assert {each.effect: each.pointers for each in quoted.effects} == expected
    shares = [each.share for each in quoted.effects]
    assert shares == sorted(shares, reverse=True)
    assert quoted.asked is not None
    for each in quoted.effects:
        assert each.cpu_seconds == pytest.approx(each.share * quoted.asked.cpu_seconds.estimate)


def test_target_quality_is_priced_when_it_is_requested(ball_scene: LoadedScene) -> None:
    asked = TargetQuality(mode="target", error=0.03, time_limit=9.0)
    quoted = quote(ball_scene, asked, limit=LONG)
    assert quoted.asked is not None
    assert quoted.asked.quality == asked
    patterns = {
        offer.quality.antialiasing.pattern
        for offer in quoted.offers
        if isinstance(offer.quality, FixedQuality) and offer.quality.antialiasing
    }
    assert patterns == {"sobol"}


def test_a_target_error_that_would_take_hours_is_priced_all_the_same(ball_scene: LoadedScene) -> None:
    asked = TargetQuality(mode="target", error=1e-6)
    quoted = quote(ball_scene, asked, target_error=1e-6)
    assert quoted.asked is not None
    assert quoted.asked.quality == asked
    assert quoted.pilot.seconds < quoted.asked.cpu_seconds.estimate


def test_double_precision_is_quoted_for_all_qualities(ball_scene: LoadedScene) -> None:
    quoted = quote(ball_scene, FixedQuality(mode="fixed", precision="double"), limit=LONG)
    assert {offer.quality.precision for offer in quoted.offers} == {"double"}


def test_without_time_there_is_the_price_and_nothing_else(ball_scene: LoadedScene) -> None:
    quoted = quote(ball_scene, target_error=0.01, seconds=1.0, limit=0.0)
    assert quoted.asked is quoted.for_error is quoted.for_seconds is None
    assert quoted.offers == quoted.effects == ()
    assert quoted.pilot.model_dump(exclude={"seconds"}) == {"blocks": 0, "pixels": 0, "target_errors": 0}


@pytest.mark.parametrize("size", [(1, 1), (1, 300), (5, 3)])
def test_pictures_of_any_size_are_quoted(size: tuple[int, int]) -> None:
    quoted = quote(renderer.load_scene(edge(*size)), limit=1.0)
    assert quoted.asked is not None
    assert quoted.asked.cpu_seconds.estimate > 0


def test_a_pilot_ends_long_before_the_picture_would() -> None:
    light = {"type": "rectangle", "center": [0, 4, 1], "normal": [0, -1, 0], "tangent": [1, 0, 0],
             "size": [1, 1], "color": [1, 1, 1]}  # fmt: skip
    document = edge(2048, 2048, light={"pattern": "random", "samples": 256}) | {"lights": [light] * 8}
    document["materials"]["grey"]["diffuse"] = 1
    quoted = quote(renderer.load_scene(document), limit=0.5)
    # A unit of work takes some hundredths of a second, and the picture ten minutes.
    assert quoted.pilot.seconds < 5
