"""Partial credit is exact, and a value equal to the threshold reaches it."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from schemas.grading.acceptance import Band, CpuSeconds, Metric, RayShare, Scale
from service.grading.outcomes import margin_of, reached, share_of

RMSE = Metric(by="metric", metric="rmse", full=0.25, zero=0.75)
SSIM = Metric(by="metric", metric="ssim", full=0.75, zero=0.25)
STEPS = CpuSeconds(full=2, bands=(Band(at=3, share=0.5), Band(at=4, share=0.25)))


@pytest.mark.parametrize(
    ("value", "scale", "share"),
    [
        (0.25, RMSE, Fraction(1)),
        (0.375, RMSE, Fraction(3, 4)),
        (0.5, RMSE, Fraction(1, 2)),
        (0.75, RMSE, Fraction(0)),
        (2.0, RMSE, Fraction(0)),
        (0.75, SSIM, Fraction(1)),
        (0.625, SSIM, Fraction(3, 4)),
        (0.25, SSIM, Fraction(0)),
        (-1.0, SSIM, Fraction(0)),
        (2.0, STEPS, Fraction(1)),
        (2.5, STEPS, Fraction(1, 2)),
        (3.0, STEPS, Fraction(1, 2)),
        (3.5, STEPS, Fraction(1, 4)),
        (4.5, STEPS, Fraction(0)),
        (0.5, RayShare(full=0.5), Fraction(1)),
        (0.25, RayShare(full=0.5), Fraction(0)),
        (float("inf"), Metric(by="metric", metric="psnr", full=30), Fraction(1)),
    ],
)
def test_number_earns_its_exact_share(value: float, scale: Scale, share: Fraction) -> None:
    # All these numbers are binary fractions, so there is no rounding.
    assert Fraction(share_of(value, scale)) == share


def test_threshold_missed_by_rounding_alone_is_reached() -> None:
    tenths = 0.1 + 0.2
    assert tenths > 0.3
    scale = Metric(by="metric", metric="rmse", full=0.3)
    assert share_of(tenths, scale) == 1.0
    assert margin_of(tenths, scale) == 0.0
    assert share_of(0.3 + 1e-12, scale) == 0.0


@given(st.floats(0, 1), st.floats(0, 1))
def test_worse_never_earns_more(one: float, other: float) -> None:
    good, bad = sorted((one, other))
    assert share_of(good, RMSE) >= share_of(bad, RMSE)
    assert share_of(good, SSIM) <= share_of(bad, SSIM)
    assert 0 <= share_of(good, RMSE) <= 1


def test_margin_is_a_signed_share_of_the_threshold() -> None:
    assert margin_of(0.125, RMSE) == 0.5
    assert margin_of(0.5, RMSE) == -1.0
    assert margin_of(1.0, Metric(by="metric", metric="ssim", full=0.5)) == 1.0
    assert margin_of(float("inf"), SSIM) is None
    assert margin_of(0.5, Metric(by="metric", metric="rmse", full=0.0)) is None


def test_nan_reaches_no_threshold() -> None:
    assert not reached(float("nan"), 0.5, rising=True)
    assert not reached(float("nan"), 0.5, rising=False)
