"""Plots of error against time, read back: SVG as XML, PNG as pixels."""

import io
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from accuracy.convergence_plot import draw

SVG = "{http://www.w3.org/2000/svg}"
TITLE = "Job 0123456789abcdef, running"
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


def words(svg: ElementTree.Element) -> str:
    return "\n".join("".join(element.itertext()).strip() for element in svg.iter(f"{SVG}text"))


@pytest.mark.slow
def test_svg_has_its_words_as_text() -> None:
    """Half of the error at order -1/2 takes 3 times as long again; numbers are written plainly."""
    found = words(drawn(FALLING, target=0.01))
    for said in (TITLE, "CPU seconds", "0.01", "time^-0.50", "48 CPU s"):
        assert said in found
    exact = passes((1000, 0.1), (4000, 0.05), (16000, 0.025), low=1, high=1)
    assert "(48000 to 48000)" in words(drawn(exact))
    wide = words(drawn(passes((1e-3, 0.1), (1, 0.01), (1e3, 0.001)))).split("\n")
    assert {"0.001", "1", "1000"} <= set(wide)


@pytest.mark.parametrize(
    "curve",
    [
        FALLING,
        passes((0.5, 0.01), low=0.0),
        passes((1, 0.1), (1, 0.1), (1, 0.1)),
        passes((1e-6, 1.0), (1e6, 1e-9), (1e7, 1e-9)),
    ],
    ids=["falling", "down to 0", "one time", "wide"],
)
def test_png_shows_the_curve_on_white(curve: list[dict[str, Any]]) -> None:
    """Each point has a marker of 4 points across: some 50 pixels at 150 an inch."""
    picture = np.asarray(Image.open(io.BytesIO(draw(curve, form="png", title=TITLE))).convert("RGB"))
    assert np.all(picture[[0, 0, -1, -1], [0, -1, 0, -1]] == 255)
    assert np.count_nonzero((picture == BLUE).all(axis=2)) > 30


def test_curve_without_errors_says_why() -> None:
    unknown = [{"seconds": 1.0, "cpu_seconds": 1.0, "error": None}]
    assert "There is no reference." in words(drawn(unknown, unknown="There is no reference."))
    for nothing in ([], passes((1, 0.0))):
        assert "No error" in words(drawn(nothing))
