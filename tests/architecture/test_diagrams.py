"""The drawn diagrams of the explanations are up to date, and can be read by everyone."""

from itertools import combinations
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.architecture.sources import ROOT
from tools.docs.diagrams import drawing
from tools.docs.draw_diagrams import FOLDER, diagrams

NAMES = sorted(path.name for path in FOLDER.iterdir())
SVG = "{http://www.w3.org/2000/svg}"
# Of the height of a font: the mean width of a letter of a wide sans-serif, as of "Verdana".
LETTER = 0.58
# How linear red, green and blue look to dichromats (Machado, Oliveira, Fernandes 2009, severity 1).
VISION = {
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}
# Distances in CIELAB below this are seen when colours are side by side, but not when they are apart.
DISTINCT = 20.0


def root(name: str) -> ElementTree.Element:
    return ElementTree.fromstring((FOLDER / name).read_text())  # noqa: S314  (our own)


def test_the_diagrams_are_what_their_script_draws() -> None:
    kept = {name: (FOLDER / name).read_text() for name in NAMES}
    assert kept == diagrams(), "run python -m tools.docs.draw_diagrams"


@pytest.mark.parametrize("name", NAMES)
def test_a_page_shows_the_diagram_and_describes_it(name: str) -> None:
    pages = [path.read_text() for path in (ROOT / "docs").glob("*/*.md")]
    assert any(
        f"](../images/diagrams/{name})" in page and f"![](../images/diagrams/{name})" not in page
        for page in pages
    )


@pytest.mark.parametrize("name", NAMES)
def test_a_diagram_has_a_title_and_a_description(name: str) -> None:
    drawn = root(name)
    labelled = (drawn.get("aria-labelledby") or "").split()
    words = {child.get("id"): child.text for child in drawn if child.tag in (f"{SVG}title", f"{SVG}desc")}
    assert [bool(words.get(name)) for name in labelled] == [True, True]


@pytest.mark.parametrize("name", NAMES)
def test_labels_are_text_that_is_large_enough_and_stays_inside(name: str) -> None:
    drawn = root(name)
    width = float(drawn.get("width") or 0)
    assert width <= drawing.WIDTH
    for text in drawn.iter(f"{SVG}text"):
        size = float(text.get("font-size") or drawing.TEXT)
        length = LETTER * size * len(text.text or "")
        begin = (
            float(text.get("x") or 0)
            - length * {"start": 0, "middle": 0.5, "end": 1}[text.get("text-anchor", "")]
        )
        assert size >= drawing.SMALL
        assert begin >= 0
        assert begin + length <= width, text.text


@pytest.mark.parametrize("vision", VISION)
def test_colours_differ_for_every_vision(vision: str) -> None:
    colours = [
        lab(VISION[vision] @ linear(name))
        for name in (drawing.LIGHT, drawing.OPEN, drawing.BLOCKED, drawing.INK)
    ]
    assert min(np.linalg.norm(a - b) for a, b in combinations(colours, 2)) > DISTINCT


def linear(colour: str) -> np.ndarray:
    """Linear sRGB of a colour written in hexadecimal."""
    encoded = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    """CIELAB (D65) of linear sRGB."""
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    ratio = np.clip(to_xyz @ rgb, 0, None) / to_xyz.sum(axis=1)
    cubic = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * cubic[1] - 16, 500 * (cubic[0] - cubic[1]), 200 * (cubic[1] - cubic[2])])
