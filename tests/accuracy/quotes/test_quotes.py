"""Quotes as a whole: offers, prices, effects, and a pilot that ends in time."""

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


def patterns(offers: tuple[Offer, ...]) -> dict[str, list[int]]:
    """Camera samples of the fixed qualities by their pattern."""
    found: dict[str, list[int]] = {}
    for offer in offers:
        if isinstance(offer.quality, FixedQuality) and offer.quality.antialiasing:
            found.setdefault(offer.quality.antialiasing.pattern, []).append(
                offer.quality.antialiasing.samples
            )
    return found


def test_offers_are_of_both_ladders_and_targets(quoted: Quote) -> None:
    counts = {"rotated": [1, 4, 9, 16, 64, 256], "sobol": [1, 4, 16, 64, 256]}
    assert patterns(quoted.offers) == counts
    targets = [offer.quality.error for offer in quoted.offers if isinstance(offer.quality, TargetQuality)]
    assert targets == [4 / 255, 0.01, 2 / 255, 1 / 255]
    assert quoted.asked in quoted.offers
    assert quoted.asked is not None
    assert isinstance(quoted.asked.quality, FixedQuality)
    assert quoted.asked.quality.antialiasing == Antialiasing(pattern="rotated", samples=9)


def test_offers_have_intervals_and_share_the_workers(quoted: Quote) -> None:
    for offer in quoted.offers:
        for known in (offer.cpu_seconds, offer.seconds, offer.error):
            assert known is None or 0 <= known.low <= known.estimate <= known.high
        if isinstance(offer.quality, FixedQuality):
            assert offer.seconds.estimate == pytest.approx(offer.cpu_seconds.estimate / 2)


def test_error_and_time_that_were_asked_for_are_kept(quoted: Quote) -> None:
    assert quoted.for_error is not None
    assert quoted.for_error.error is not None
    assert quoted.for_error.error.estimate <= 0.01
    assert quoted.for_seconds is not None
    assert quoted.for_seconds.seconds.estimate <= 5.0 * (1 + 1e-9)


def test_effects_come_with_pointers_most_costly_first(ball_scene: LoadedScene) -> None:
    quoted = quote(ball_scene, limit=LONG)
    expected = {each.effect: each.pointers for each in variants(ball_scene.document)}
    del expected["antialiasing"]
    assert {each.effect: each.pointers for each in quoted.effects} == expected
    shares = [each.share for each in quoted.effects]
    assert shares == sorted(shares, reverse=True)
    assert quoted.asked is not None
    for each in quoted.effects:
        assert each.cpu_seconds == pytest.approx(each.share * quoted.asked.cpu_seconds.estimate)


@pytest.mark.parametrize(("error", "limit"), [(0.03, 9.0), pytest.param(1e-6, None, marks=pytest.mark.slow)])
def test_target_quality_is_priced(ball_scene: LoadedScene, error: float, limit: float | None) -> None:
    """Also one that would take hours."""
    asked = TargetQuality(mode="target", error=error, time_limit=limit)
    quoted = quote(ball_scene, asked, target_error=error, limit=LONG)
    assert quoted.asked is not None
    assert quoted.asked.quality == asked
    assert patterns(quoted.offers).keys() == {"sobol"}
    assert limit or quoted.asked.cpu_seconds.estimate > LONG / 2


def test_quote_without_time_has_the_price_alone(ball_scene: LoadedScene) -> None:
    quality = FixedQuality(mode="fixed", light=LightSampling(pattern="uniform", samples=64))
    quoted = quote(ball_scene, quality, target_error=0.01, seconds=1.0, limit=0.0)
    assert quoted.price == renderer.compile_scene(ball_scene, quality).describe().cost
    assert quoted.asked is quoted.for_error is quoted.for_seconds is None
    assert quoted.offers == quoted.effects == ()
    assert quoted.pilot.model_dump(exclude={"seconds"}) == {"blocks": 0, "pixels": 0, "target_errors": 0}


def test_pilot_ends_long_before_the_picture_would() -> None:
    light = {"type": "rectangle", "center": [0, 4, 1], "normal": [0, -1, 0], "tangent": [1, 0, 0],
             "size": [1, 1], "color": [1, 1, 1]}  # fmt: skip
    document = edge(2048, 2048, light={"pattern": "random", "samples": 256}) | {"lights": [light] * 8}
    document["materials"]["grey"]["diffuse"] = 1
    quoted = quote(renderer.load_scene(document), limit=0.5)
    # A unit of work takes some hundredths of a second, and the picture ten minutes.
    assert quoted.pilot.seconds < 5
