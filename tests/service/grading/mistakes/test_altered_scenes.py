"""Mistakes made in plans: each gives the numbers that its formula gives by hand."""

from typing import Any

import numpy as np
import pytest

import renderer
from renderer.plan.plan import RenderPlan
from service.grading.mistakes.altered_shading import altered_shading, without_shadows
from service.grading.mistakes.shadow_patterns import acne

Document = dict[str, Any]

EYE = np.array([0.0, 1.0, 3.0])
LAMP = np.array([0.4, 0.9, 3.2])
"""Close to the eye and low: the reflection leaves away from the eye."""

COLOR = np.array([0.5, 0.25, 0.75])
DIFFUSE, SPECULAR = 0.5, 0.4

ROUNDING = 1e-5
"""Pair work is in float32, whose 2**-24 powers and products raise some hundred times."""


SHEET = {"type": "rectangle", "corner": [-1, 0, -1], "edges": [[0, 0, 2], [2, 0, 0]], "material": "floor"}
PLASTIC = {"type": "phong", "color": COLOR.tolist(), "ambient": 0, "diffuse": DIFFUSE, "specular": SPECULAR}


def floor(shininess: float = 2.0, lamp: np.ndarray = LAMP, **camera: Any) -> Document:
    """One pixel that shows the middle of a floor under a lamp."""
    return {
        "version": 1,
        "camera": {"position": EYE.tolist(), "look_at": [0, 0, 0], "width": 1, "height": 1} | camera,
        "materials": {"floor": PLASTIC | {"shininess": shininess}},
        "shapes": [SHEET],
        "lights": [{"type": "point", "position": lamp.tolist(), "color": [1, 1, 1]}],
        "sampling": {"antialiasing": {"pattern": "center", "samples": 1}},
    }


def changes(cause: str, plan: RenderPlan) -> list[RenderPlan]:
    """The plan with a mistake, once for each variant."""
    return [change(plan) for name, change in altered_shading(plan.document) if name == cause]


def shown(cause: str, document: Document) -> list[np.ndarray]:
    """The pixel with a mistake, once for each variant."""
    return [renderer.render(plan).image[0, 0] for plan in changes(cause, renderer.compile_scene(document))]


def unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


NORMAL, VIEWER, LIGHT = np.array([0.0, 1.0, 0.0]), unit(EYE), unit(LAMP)
LAMBERT = float(NORMAL @ LIGHT)
GLOSS = float((2 * LAMBERT * NORMAL - LIGHT) @ VIEWER)
MATT = DIFFUSE * LAMBERT * COLOR


def test_right_shading_is_the_formula() -> None:
    assert LAMBERT > 0 > GLOSS
    right = renderer.render(renderer.compile_scene(floor())).image[0, 0]
    np.testing.assert_allclose(right, MATT, rtol=ROUNDING)


BELOW, BEHIND, MIRROR = LAMP * [1, -1, 1], np.array([-0.4, 0.9, -2.0]), np.array([0.0, 1.0, -3.0])
ROUND = {"shapes": [{"type": "ellipsoid", "center": [0, 0, 0], "radius": 1, "material": "floor"}]}
LONG_GLOSS = float((2 * BEHIND[1] * NORMAL - BEHIND) @ VIEWER)
UNDER_GLOSS = max(0.0, float((-2 * LAMBERT * NORMAL - unit(BELOW)) @ VIEWER))


@pytest.mark.parametrize(
    ("cause", "document", "expected"),
    [
        *(
            ("highlight_not_clamped", floor(power), MATT + SPECULAR * GLOSS**power)
            for power in (1.0, 2.0, 3.0)
        ),
        ("halfway_vector", floor(), MATT + SPECULAR * float(NORMAL @ unit(LIGHT + VIEWER)) ** 2),
        ("light_not_normalised", floor(lamp=BEHIND), DIFFUSE * BEHIND[1] * COLOR + SPECULAR * LONG_GLOSS**2),
        # In the mirror direction r . v is 1.
        ("highlight_colored", floor(lamp=MIRROR), (DIFFUSE * unit(MIRROR)[1] + SPECULAR) * COLOR),
        ("normals_flipped", floor(), 0 * COLOR),
        ("normals_flipped", floor(lamp=BELOW), MATT + SPECULAR * UNDER_GLOSS**2),
        ("normals_flipped", floor() | ROUND, 0 * COLOR),
        ("normals_flipped", floor(lamp=-10 * LAMP) | ROUND, 0 * COLOR),
        ("cosine_not_clamped", floor(lamp=BELOW), -MATT),
    ],
)
def test_wrong_shading_is_its_formula(cause: str, document: Document, expected: np.ndarray) -> None:
    for pixel in shown(cause, document):
        np.testing.assert_allclose(pixel, expected, rtol=ROUNDING)


def test_cosine_not_clamped_with_and_without_own_shadow() -> None:
    shadowed, lit = shown("cosine_not_clamped", floor(lamp=-10 * LAMP) | ROUND)
    assert (shadowed == 0).all()
    assert (lit < 0).all()


def test_shadows_missing_light_a_covered_floor() -> None:
    document = floor(lamp=np.array([0.0, 9.0, 0.0]))
    roof = {"type": "rectangle", "corner": [-9, 4, -9], "edges": [[18, 0, 0], [0, 0, 18]]}
    shapes = [*document["shapes"], roof | {"material": "floor"}]
    plan = renderer.compile_scene(document | {"shapes": shapes})
    assert (renderer.render(plan).image[0, 0] == 0).all()
    lit = renderer.render(without_shadows(plan)).image[0, 0]
    np.testing.assert_allclose(lit, DIFFUSE * COLOR + SPECULAR * VIEWER[1] ** 2, rtol=ROUNDING)


def lit_sheet(share: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A sheet without its light, with a share of it, and with all of it, brighter to the right."""
    direct = np.linspace(0.2, 0.6, 32)[None, :, None] * np.array([1, 0.5, 0.8])
    dark = np.full((24, 32, 3), 0.05)
    return dark, dark + share[:, :, None] * direct, dark + direct


@pytest.mark.parametrize("rays", [4, 16, 64])
def test_light_blocked_at_random_is_acne(rays: int) -> None:
    share = np.random.default_rng(rays).binomial(rays, 0.6, (24, 32)) / rays
    found = acne(*lit_sheet(share))
    assert found is not None
    assert found.cause == "shadow_acne"


@pytest.mark.parametrize(
    "share",
    [np.full((24, 32), 0.5), np.linspace(0.2, 0.9, 24 * 32).reshape(24, 32), np.zeros((24, 32))],
    ids=["half", "slope", "none"],
)
def test_light_dimmed_smoothly_is_no_acne(share: np.ndarray) -> None:
    assert acne(*lit_sheet(share)) is None
