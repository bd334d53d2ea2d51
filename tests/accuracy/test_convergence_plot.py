"""Plots of error against time, read back: SVG as XML, PNG as pixels."""

from __future__ import annotations

import io
import re
import sys
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from accuracy.convergence_plot import SIZE, draw
from accuracy.plotting import DOTS
from renderer.errors import MissingExtraError

SVG = "{http://www.w3.org/2000/svg}"
TITLE = "Job 0123456789abcdef, running"
# Error bars and markers of the curve, in the colour that the plot gives it.
BLUE = (0x44, 0x77, 0xAA)


def passes(*points: tuple[float, float], low: float = 0.9, high: float = 1.1) -> list[dict[str, Any]]:
    return [
        {
            "seconds": time,
            "cpu_seconds": time,
            "error": {"estimate": error, "low": low * error, "high": high * error},
        }
        for time, error in points
    ]


FALLING = passes((1, 0.1), (4, 0.05), (16, 0.025))


def drawn(curve: list[dict[str, Any]], **options: Any) -> ElementTree.Element:
    return ElementTree.fromstring(draw(curve, form="svg", title=TITLE, **options))  # noqa: S314 - our own


def texts(svg: ElementTree.Element) -> list[str]:
    return ["".join(element.itertext()).strip() for element in svg.iter(f"{SVG}text")]


def test_an_svg_has_its_words_as_text() -> None:
    words = texts(drawn(FALLING, target=0.01))
    assert TITLE in words
    assert "CPU seconds" in words
    assert any(word.startswith("error (RMSE") for word in words)
    assert "asked for: 0.01" in words
    assert any(re.fullmatch(r"error ~ time\^-0\.50 \(-\d.* to .*\)", word) for word in words)
    # A half of the error at order -1/2 takes 3 times as long again: 48 CPU seconds.
    assert any("48 CPU s more" in word for word in words)


def corners_of(svg: ElementTree.Element) -> list[tuple[float, float]]:
    """Corners of the line through the passes."""
    (line,) = (group for group in svg.iter(f"{SVG}g") if group.get("id") == "passes")
    path = next(line.iter(f"{SVG}path")).get("d", "")
    numbers = [float(word) for word in re.findall(r"-?[\d.]+", path)]
    return list(zip(numbers[::2], numbers[1::2], strict=True))


def test_a_power_law_is_a_straight_line_on_the_plot() -> None:
    (x0, y0), (x1, y1), (x2, y2) = corners_of(drawn(FALLING))
    # Equal factors are equal lengths; downwards is a greater y in an SVG, which has 6 digits after the point.
    assert x1 - x0 == pytest.approx(x2 - x1, abs=1e-5)
    assert y1 - y0 == pytest.approx(y2 - y1, abs=1e-5)
    assert x1 > x0
    assert y1 > y0


@pytest.mark.parametrize(
    "curve",
    [
        FALLING,
        passes((0.5, 0.01)),
        passes((0.5, 0.01), low=0.0),
        passes((1, 0.1), (1, 0.1), (1, 0.1)),
        passes((1e-6, 1.0), (1e6, 1e-9), (1e7, 1e-9)),
        passes((1, 0.1), (2, 0.1001), (3, 0.0999)),
    ],
    ids=["falling", "one", "down to 0", "one time", "wide", "level"],
)
def test_a_png_is_a_picture_of_the_curve_on_white(curve: list[dict[str, Any]]) -> None:
    picture = np.asarray(Image.open(io.BytesIO(draw(curve, form="png", title=TITLE))).convert("RGB"))
    assert picture.shape == (SIZE[1] * DOTS, SIZE[0] * DOTS, 3)
    corners = picture[[0, 0, -1, -1], [0, -1, 0, -1]]
    assert np.all(corners == 255)
    # Each point has a marker of 4 points across: some 50 pixels at 150 an inch.
    assert np.count_nonzero((picture == BLUE).all(axis=2)) > 30


def test_costs_are_written_in_plain_numbers() -> None:
    words = texts(drawn(passes((1000, 0.1), (4000, 0.05), (16000, 0.025), low=1, high=1)))
    # At order -1/2 half the error takes three times 16000 more; points on the line leave nothing unsure.
    assert any("48000 CPU s more (48000 to 48000)" in word for word in words)


def test_numbers_on_the_axes_are_plain() -> None:
    words = texts(drawn(passes((1e-3, 0.1), (1, 0.01), (1e3, 0.001))))
    assert {"0.001", "1", "1000"} <= set(words)


def test_a_curve_without_errors_says_why() -> None:
    unknown = [{"seconds": 1.0, "cpu_seconds": 1.0, "error": None}]
    words = " ".join(texts(drawn(unknown, unknown="There is no reference.")))
    assert "There is no reference." in words
    for nothing in ([], passes((1, 0.0))):
        assert "No error" in " ".join(texts(drawn(nothing)))


@pytest.mark.parametrize("form", ["svg", "png"])
def test_the_same_curve_has_the_same_bytes(form: str) -> None:
    one, other = (draw(FALLING, form=form, title=TITLE) for _ in range(2))
    assert one == other
    assert one != draw(FALLING[:2], form=form, title=TITLE)


@pytest.mark.parametrize("form", ["svg", "png"])
def test_without_the_library_the_extra_is_named(monkeypatch: pytest.MonkeyPatch, form: str) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'penumbra-render\[study\]'"):
        draw(FALLING, form=form, title=TITLE)
