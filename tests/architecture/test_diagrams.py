"""The drawn diagrams of the explanations are up to date, and everyone can read them."""

from itertools import combinations
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.architecture.sources import ROOT
from tools.docs.diagrams import drawing
from tools.docs.draw_diagrams import FOLDER, diagrams

NAMES = sorted(path.name for path in FOLDER.iterdir())
SVG = "{http://www.w3.org/2000/svg}"
LETTER = 0.54
"""Mean width of a letter of a common sans-serif font, in heights of the font."""
VISION = {
    "protanopia": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "deuteranopia": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "tritanopia": [[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]],
}
"""How dichromats see linear red, green and blue (Machado, Oliveira, Fernandes 2009, severity 1)."""
DISTINCT = 20.0
"""Distance in CIELAB of colours that differ at a glance; 2.3 is just noticeable."""


class Label(NamedTuple):
    """About where a label is."""

    left: float
    top: float
    right: float
    bottom: float
    size: float
    text: str

    def covers(self, other: "Label") -> bool:
        """Whether two labels have a place in common."""
        across = self.left < other.right and other.left < self.right
        return across and self.top < other.bottom and other.top < self.bottom


def root(name: str) -> ElementTree.Element:
    return ElementTree.fromstring((FOLDER / name).read_text())  # noqa: S314  (our own)


def labels(name: str) -> list[Label]:
    return [label(text) for text in root(name).iter(f"{SVG}text")]


def label(text: ElementTree.Element) -> Label:
    words, size = text.text or "", float(text.get("font-size", drawing.TEXT))
    width = LETTER * size * len(words)
    left = (
        float(text.get("x", 0)) - width * {"start": 0, "middle": 0.5, "end": 1}[text.get("text-anchor", "")]
    )
    baseline = float(text.get("y", 0))
    return Label(left, baseline - 0.75 * size, left + width, baseline + 0.2 * size, size, words)


def test_the_diagrams_are_what_their_script_draws() -> None:
    kept = {name: (FOLDER / name).read_text() for name in NAMES}
    assert kept == diagrams(), "run python -m tools.docs.draw_diagrams"


@pytest.mark.parametrize("name", NAMES)
def test_a_page_shows_the_diagram_and_describes_it(name: str) -> None:
    pages = [path.read_text() for path in (ROOT / "docs").glob("*/*.md")]
    shown = [page for page in pages if f"](../images/diagrams/{name})" in page]
    assert shown
    assert not any(f"![](../images/diagrams/{name})" in page for page in shown)


@pytest.mark.parametrize("name", NAMES)
def test_a_diagram_has_a_title_and_a_description_for_screen_readers(name: str) -> None:
    drawn = root(name)
    words = {child.get("id"): child.text for child in drawn if child.tag in {f"{SVG}title", f"{SVG}desc"}}
    labelled = drawn.get("aria-labelledby", "").split()
    assert [bool(words.get(part)) for part in labelled] == [True, True]


@pytest.mark.parametrize("name", NAMES)
def test_labels_are_large_enough_in_a_column_of_text_and_stay_inside(name: str) -> None:
    width, height = (float(root(name).get(side, 0)) for side in ("width", "height"))
    assert width <= drawing.WIDTH
    assert min(found.size for found in labels(name)) >= drawing.SMALL
    outside = [
        found.text
        for found in labels(name)
        if found.left < 0 or found.right > width or found.top < 0 or found.bottom > height
    ]
    assert outside == []


@pytest.mark.parametrize("name", NAMES)
def test_no_label_covers_another(name: str) -> None:
    pairs = combinations(labels(name), 2)
    assert [(one.text, other.text) for one, other in pairs if one.covers(other)] == []


@pytest.mark.parametrize("vision", VISION)
def test_colours_differ_whatever_colours_a_reader_sees(vision: str) -> None:
    meanings = (drawing.LIGHT, drawing.OPEN, drawing.BLOCKED, drawing.SOLID, drawing.INK)
    seen = [lab(np.array(VISION[vision]) @ linear(colour)) for colour in meanings]
    assert min(np.linalg.norm(one - other) for one, other in combinations(seen, 2)) > DISTINCT


def linear(colour: str) -> np.ndarray:
    """Linear sRGB of a colour that is written in hexadecimal."""
    encoded = np.array([int(colour[place : place + 2], 16) for place in (1, 3, 5)]) / 255
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def lab(rgb: np.ndarray) -> np.ndarray:
    """CIELAB of linear sRGB, with the white of D65."""
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    share = np.clip(to_xyz @ rgb, 0, None) / to_xyz.sum(axis=1)
    root3 = np.where(share > (6 / 29) ** 3, np.cbrt(share), share / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * root3[1] - 16, 500 * (root3[0] - root3[1]), 200 * (root3[1] - root3[2])])
