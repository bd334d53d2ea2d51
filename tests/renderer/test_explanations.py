"""The plan of target quality lists what its pilot samples do in another way."""

import json
from pathlib import Path
from typing import Any

import pytest

import renderer
from accuracy.hard_cases.documents import Json, bulb, camera, lamp, phong, rectangle, scene, sphere
from renderer.adaptive.levels import COVERAGES
from schemas.api.plans import PlanDocument
from schemas.quality import FixedQuality, TargetQuality

GALLERY = sorted((Path(__file__).parents[2] / "scenes" / "gallery").glob("*.json"))
FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
BALL = sphere([0, 1, 0], 1)
ABOVE = lamp([-1, 3, -1], [2, 0, 0], [0, 0, 2])
BOARD = {"type": "checker"}


def described(document: Json, error: float = 2.0**-8, **options: Any) -> PlanDocument:
    quality = TargetQuality(mode="target", error=error, **options)
    return renderer.compile_scene(document, quality).describe()


def details(document: Json, error: float = 2.0**-8, **options: Any) -> dict[str, str]:
    return {stage.name: stage.detail for stage in described(document, error, **options).pilot_samples}


def furnished(**changes: Any) -> Json:
    return scene(FLOOR, BALL, lights=[ABOVE], **changes)


def resolved(pointer: str, document: Any) -> Any:
    for token in pointer.split("/")[1:]:
        document = document[int(token) if isinstance(document, list) else token]
    return document


def test_fixed_quality_has_no_pilot_samples() -> None:
    fixed = FixedQuality(mode="fixed")
    assert renderer.compile_scene(furnished(), fixed).describe().pilot_samples == ()


def test_pilot_samples_are_listed_in_order_with_their_pointers() -> None:
    materials = {"plain": phong(color_texture="board")}
    document = furnished(textures={"board": BOARD, "other": BOARD}, materials=materials)
    assert [(stage.name, stage.pointers) for stage in described(document).pilot_samples] == [
        ("pilot samples", ("/camera",)),
        ("view of light 0", ("/lights/0",)),
        ("light 0 fully visible", ("/lights/0",)),
        ("light 0 partly visible", ("/lights/0",)),
        ("means of color texture board", ("/textures/board", "/materials/plain/color_texture")),
        ("borders", ("/camera",)),
    ]


@pytest.mark.parametrize("path", GALLERY, ids=lambda path: path.stem)
def test_every_pilot_sample_of_a_gallery_scene_points_at_lines_that_are_there(path: Path) -> None:
    document = json.loads(path.read_bytes())
    plan = renderer.compile_scene(path, TargetQuality(mode="target", error=0.004)).describe()
    assert bool(plan.pilot_samples) == (document["camera"].get("lens_radius", 0) == 0)
    for stage in plan.pilot_samples:
        assert all(resolved(pointer, document) is not None for pointer in stage.pointers)


def test_no_pilot_sample_probes_a_light_that_nothing_can_hide() -> None:
    found = details(scene(FLOOR, lights=[ABOVE]))
    assert "light 0 fully visible" in found
    assert not found.keys() & {"view of light 0", "light 0 partly visible"}


def test_a_light_without_an_area_is_sampled_as_always() -> None:
    found = details(scene(FLOOR, BALL, lights=[bulb([0, 3, 0])]))
    assert found.keys() == {"pilot samples", "borders", "shadow edges"}


@pytest.mark.parametrize(
    ("error", "limit", "points"),
    [(2.0**-8, None, 64), (2.0**-9, None, 128), (2.0**-10, None, 256), (2.0**-10, 5.0, 128)],
)
def test_half_the_error_has_twice_the_points_in_penumbrae_down_to_a_floor_where_time_is_short(
    error: float, limit: float | None, points: int
) -> None:
    found = details(furnished(), error, time_limit=limit)
    assert found["light 0 partly visible"] == f"{points} sobol points with shadow rays"


def test_borders_are_listed_with_the_fewest_rays_they_get() -> None:
    """Two lattices of two rays. How many more there are is known when the contrasts are."""
    found = details(furnished())["borders"]
    assert found.startswith("rays measure how much of a pixel each shape fills")
    assert found.endswith(f"from {COVERAGES[1]} on")
    assert COVERAGES[1] == 4


def test_edges_of_hard_shadows_on_flat_shapes_are_requested_by_lights() -> None:
    sheet = rectangle([-0.5, 1, -0.5], [0, 0, 1], [1, 0, 0])
    document = scene(FLOOR, sheet, lights=[bulb([0, 3, 0])])
    edges = described(document).pilot_samples[-1]
    assert (edges.name, edges.pointers) == ("shadow edges", ("/lights/0",))
    assert int(edges.detail.split()[0]) > 0
    assert "shadow edges" not in details(scene(FLOOR, lights=[bulb([0, 3, 0])]))


@pytest.mark.parametrize(("width", "apart"), [(64, None), (256, 2), (512, 4), (4096, 8)])
def test_pilot_samples_of_larger_pictures_lie_farther_apart(width: int, apart: int | None) -> None:
    """About 128 x 128 of them, none more than 8 pixels apart."""
    found = details(furnished(camera=camera(width=width, height=width)))["pilot samples"]
    assert found.startswith(
        "one ray through the centre of " + (f"pixels {apart} pixels apart" if apart else "each pixel")
    )


@pytest.mark.parametrize(
    ("brightness", "exponent", "cells"), [(0.01, 0, 2), (0.01, 60, 4), (1.0, 0, 8), (1.0, 20, 16)]
)
def test_the_finest_grid_on_a_light_goes_with_its_brightness_and_the_sharpest_highlight(
    brightness: float, exponent: int, cells: int
) -> None:
    """The midpoint rule with n cells errs by b (2 + 2 s e) (size / distance)**2 / (24 n n).

    Of an error of 1/6 a quarter is allowed, at a distance of a quarter of the size, and s is 1/2 with an
    exponent e: n = 4 sqrt(b (2 + e)), which is 0.6, 3.1, 5.7 and 18.8. There are 2, 4, 8 and 16.
    """
    shiny = {"specular": 0.5, "shininess": exponent} if exponent else {}
    light = ABOVE | {"color": [brightness] * 3}
    document = scene(FLOOR, BALL, lights=[light], materials={"plain": phong(**shiny)})
    grids = f"a grid of 4 to {cells**2} points" if cells > 2 else "a grid of 4 points"
    assert details(document, 1 / 6)["light 0 fully visible"].startswith(grids)


def test_a_lens_needs_a_lattice_of_samples_and_no_pilot_samples() -> None:
    plan = described(furnished(camera=camera(lens_radius=0.1, focus_distance=5.0)))
    assert plan.pilot_samples == ()
    (stage,) = [stage for stage in plan.stages if stage.name == "lattice of samples"]
    assert stage.pointers == ("/camera/lens_radius", "/camera/focus_distance")
    assert stage.effect == "camera.lens"


def test_neither_a_pinhole_nor_fixed_quality_samples_a_lattice() -> None:
    lens = furnished(camera=camera(lens_radius=0.1))
    for plan in (described(furnished()), renderer.compile_scene(lens).describe()):
        assert "lattice of samples" not in [stage.name for stage in plan.stages]
