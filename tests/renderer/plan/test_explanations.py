"""The plan of target quality lists its pilot samples with pointers."""

from typing import Any

import pytest

import renderer
from schemas.api.plans import PlanDocument
from schemas.quality import FixedQuality, TargetQuality
from tests.documents import Json, bulb, camera, lamp, phong, rectangle, scene, sphere

FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
BALL = sphere([0, 1, 0], 1)
ABOVE = lamp([-1, 3, -1], [2, 0, 0], [0, 0, 2])


def described(document: Json, error: float = 2.0**-8, **options: Any) -> PlanDocument:
    return renderer.compile_scene(document, TargetQuality(error=error, **options)).describe()


def details(document: Json, error: float = 2.0**-8, **options: Any) -> dict[str, str]:
    return {stage.name: stage.detail for stage in described(document, error, **options).pilot_samples}


def furnished(**changes: Any) -> Json:
    return scene(FLOOR, BALL, lights=[ABOVE], **changes)


def test_pilot_samples_are_listed_with_pointers() -> None:
    board = {"type": "checker"}
    materials = {"plain": phong(color_texture="board")}
    document = furnished(textures={"board": board, "other": board}, materials=materials)
    assert [(stage.name, stage.pointers) for stage in described(document).pilot_samples] == [
        ("pilot samples", ("/camera",)),
        ("view of light 0", ("/lights/0",)),
        ("light 0 fully visible", ("/lights/0",)),
        ("light 0 partly visible", ("/lights/0",)),
        ("means of color texture board", ("/textures/board", "/materials/plain/color_texture")),
        ("borders", ("/camera",)),
    ]
    assert renderer.compile_scene(document, FixedQuality()).describe().pilot_samples == ()


def test_pilot_samples_are_those_that_lights_need() -> None:
    """A lamp that nothing hides is not probed, a point light has no area, and strips have thin shadows."""
    strip = rectangle([-0.5, 1, -0.5], [0, 0, 1], [0.01, 0, 0])
    unhidden = details(scene(FLOOR, lights=[ABOVE]))
    assert "light 0 fully visible" in unhidden
    assert not unhidden.keys() & {"view of light 0", "light 0 partly visible"}
    usual = {"pilot samples", "borders"}
    assert details(scene(FLOOR, BALL, lights=[bulb([0, 3, 0])])).keys() == usual
    assert details(scene(FLOOR, lights=[bulb([0, 3, 0])])).keys() == usual
    thin = described(scene(FLOOR, strip, lights=[bulb([0, 3, 0])])).pilot_samples[-1]
    assert (thin.name, thin.pointers) == ("thin shadows", ("/lights/0",))


@pytest.mark.parametrize(
    ("error", "limit", "points"),
    [(2.0**-8, None, 64), (2.0**-9, None, 128), (2.0**-10, None, 256), (2.0**-10, 5.0, 128)],
)
def test_penumbra_points_double_as_the_error_halves(error: float, limit: float | None, points: int) -> None:
    """Down to a floor where time is short."""
    found = details(furnished(), error, time_limit=limit)
    assert found["light 0 partly visible"].split()[0] == str(points)


@pytest.mark.parametrize(
    ("brightness", "exponent", "cells"), [(0.01, 0, 2), (0.01, 60, 4), (1.0, 0, 8), (1.0, 20, 16)]
)
def test_light_grid_follows_brightness_and_highlights(brightness: float, exponent: int, cells: int) -> None:
    """The midpoint rule errs by b (2 + 2 s e) (size / distance)**2 / (24 n n): n is 0.6, 3.1, 5.7, 18.8."""
    shiny = {"specular": 0.5, "shininess": exponent} if exponent else {}
    light = ABOVE | {"color": [brightness] * 3}
    document = scene(FLOOR, BALL, lights=[light], materials={"plain": phong(**shiny)})
    found = details(document, 1 / 6)["light 0 fully visible"]
    assert str(cells**2) in found.split()


def test_lens_has_a_lattice_and_no_pilot_samples() -> None:
    lens = furnished(camera=camera(lens_radius=0.1, focus_distance=5.0))
    plan = described(lens)
    assert plan.pilot_samples == ()
    (stage,) = [stage for stage in plan.stages if stage.name == "lattice of samples"]
    assert (stage.effect, stage.pointers) == (
        "camera.lens",
        ("/camera/lens_radius", "/camera/focus_distance"),
    )
    for other in (described(furnished()), renderer.compile_scene(lens).describe()):
        assert "lattice of samples" not in [stage.name for stage in other.stages]
