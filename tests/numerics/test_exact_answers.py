"""Exact answers that are no rational numbers have 50 digits, whatever mpmath works with around them."""

import ast
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import accuracy.hard_cases
from accuracy.hard_cases import cameras, ellipsoids, formulas, harness, oracle, phong
from accuracy.hard_cases.documents import ellipsoid, scene
from accuracy.hard_cases.samples_and_output import output, samples
from accuracy.hard_cases.scene_values import values
from schemas.reading import read_scene

FOLDER = Path(accuracy.hard_cases.__file__).parent
RNG = np.random.default_rng(1)
PLACES = RNG.uniform(0.1, 0.7, (40, 2)).tolist()
VECTORS = RNG.normal(size=(3, 40))
LIGHT = np.array([[0.3], [0.8], [-0.1]])


def pixel_centres() -> Any:
    return cameras.exact_places(641, Fraction(3, 7))[0].tolist()


def texture_coordinates() -> Any:
    shape = read_scene(scene(ellipsoid([0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3])))[0].shapes[0]
    return [oracle.answer(shape, [4 * x for x in v], [-x for x in v]).uv for v in VECTORS.T.tolist()]


ORACLES: dict[str, Callable[[], Any]] = {
    "pixel centres": pixel_centres,
    "places on a lens": lambda: [cameras.on_the_disk(*place) for place in PLACES],
    "texture coordinates of ellipsoids": texture_coordinates,
    "texture coordinates at poles": lambda: [
        ellipsoids.exact_coordinates(*p, -1) for p in PLACES if sum(p) < 1
    ],
    "highlights": lambda: phong.exact_highlights(LIGHT, np.abs(VECTORS), 20.5).tolist(),
    "reflections": lambda: phong.exact_reflections(VECTORS, VECTORS[:, ::-1]).tolist(),
    "Fresnel's shares": lambda: [formulas.true_fresnel(x, y) for x, y in PLACES],
    "turned grids": lambda: samples.wrapped(20),
    "the curve of sRGB": lambda: [output.curve_of(x) for x, _ in PLACES],
    "unit vectors": lambda: values.exact_units(VECTORS).tolist(),
}


@pytest.mark.parametrize("ask", ORACLES.values(), ids=ORACLES)
def test_an_exact_answer_has_50_digits(ask: Callable[[], Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """More digits change no bit of it, and 15 do: they are too few, and no case works with them."""
    assert mpmath.mp.dps == 15
    fifty = ask()
    monkeypatch.setattr(harness, "DIGITS", 100)
    assert ask() == fifty
    monkeypatch.setattr(harness, "DIGITS", 15)
    assert ask() != fifty


def in_mpmath(tree: ast.AST) -> list[ast.FunctionDef]:
    """Functions of a module whose bodies use mpmath."""
    return [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and any(isinstance(part, ast.Name) and part.id == "mpmath" for part in ast.walk(node))
    ]


def test_every_function_that_uses_mpmath_is_exact_or_hands_on_its_numbers() -> None:
    """What hands them on returns a number of mpmath, which only an exact function turns into a double."""
    found, loose = 0, []
    for path in FOLDER.rglob("*.py"):
        if path.name == "harness.py":
            continue
        for function in in_mpmath(ast.parse(path.read_text(encoding="utf-8"))):
            found += 1
            decorated = {ast.unparse(each) for each in function.decorator_list}
            returned = ast.unparse(function.returns) if function.returns else ""
            if "exact" not in decorated and returned != "mpmath.mpf":
                loose.append(f"{path.name}: {function.name}")
    assert found > 8
    assert not loose
