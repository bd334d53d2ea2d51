"""The plan of target quality lists what its pilot samples do in another way."""

import json
from pathlib import Path
from typing import Any

import pytest

import renderer
from accuracy.hard_cases.documents import Json, bulb, camera, lamp, phong, rectangle, scene, sphere
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


def test_pilot_samples_in_order() -> None:
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
def test_pointers_of_the_gallery(path: Path) -> None:
    document = json.loads(path.read_bytes())
    plan = renderer.compile_scene(path, TargetQuality(mode="target", error=0.004)).describe()
    assert bool(plan.pilot_samples) == (document["camera"].get("lens_radius", 0) == 0)
    for stage in plan.pilot_samples:
        assert all(resolved(pointer, document) is not None for pointer in stage.pointers)


def test_light_that_nothing_can_hide() -> None:
    found = details(scene(FLOOR, lights=[ABOVE]))
    assert "light 0 fully visible" in found
    assert not found.keys() & {"view of light 0", "light 0 partly visible"}


@pytest.mark.parametrize(
    ("error", "limit", "points"),
    [(2.0**-8, None, 64), (2.0**-9, None, 128), (2.0**-10, None, 256), (2.0**-10, 5.0, 128)],
)
def test_points_in_penumbrae_by_error(error: float, limit: float | None, points: int) -> None:
    found = details(furnished(), error, time_limit=limit)
    assert found["light 0 partly visible"] == f"{points} sobol points with shadow rays"


def test_edges_of_hard_shadows() -> None:
    sheet = rectangle([-0.5, 1, -0.5], [0, 0, 1], [1, 0, 0])
    document = scene(FLOOR, sheet, lights=[bulb([0, 3, 0])])
    edges = described(document).pilot_samples[-1]
    assert (edges.name, edges.pointers) == ("shadow edges", ("/lights/0",))
    assert int(edges.detail.split()[0]) > 0
    assert "shadow edges" not in details(scene(FLOOR, lights=[bulb([0, 3, 0])]))


def test_lens_has_a_lattice() -> None:
    plan = described(furnished(camera=camera(lens_radius=0.1, focus_distance=5.0)))
    assert plan.pilot_samples == ()
    (stage,) = [stage for stage in plan.stages if stage.name == "lattice of samples"]
    assert stage.pointers == ("/camera/lens_radius", "/camera/focus_distance")
    assert stage.effect == "camera.lens"
