"""Kinds that are added by one class and one line are right everywhere, with nothing else written for them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.inspection import inspect, inspection_plan
from accuracy.statistics import clipped
from renderer.plan.effects import MATERIALS, SHAPES, cast_by_segments, registered
from schemas.materials import PhongMaterial
from schemas.quality import FixedQuality, Quality, TargetQuality
from service.grading.mistakes.altered_shading import altered_shading
from tests.documents import Json, bulb, camera, lamp, phong, rectangle, sampled, sphere, spot
from tests.pictures.literal import Drawing
from tests.pictures.parts import DOUBLE, SINGLE, Files, samples_of
from tests.pictures.references import root_of_product
from tests.pictures.test_literal_pairs import PNGS, compared
from tests.renderer.plan.newcomers import MINNAERT, TUBE, LargerScene, Minnaert, Tube


@pytest.fixture(autouse=True)
def newcomers(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line each."""
    monkeypatch.setitem(SHAPES, Tube, TUBE)
    monkeypatch.setitem(MATERIALS, Minnaert, MINNAERT)


LIGHTS = {
    "lamp": lamp([-1.5, 4, 1], [1, 0, 0], [0, 0, 1]),
    "bulb": bulb([2, 3, 2], [5.0, 6, 7]) | {"falloff": "physical"},
    "spot": spot([1, 5, 2], [-1, -5, -2], outer_angle=25),
}


def tube(base: Any, axis: Any, radius: float, **more: Any) -> Json:
    return {"type": "tube", "base": base, "axis": axis, "radius": radius, "material": "dusty"} | more


def larger(light: str, side: int = 24, **changes: Any) -> LargerScene:
    """Tubes that stand, lie and hang among shapes that the package has; one is looked into, one mirrors."""
    materials = {
        "plain": phong(specular=0.3, shininess=30, mirror=0.2),
        "dusty": {"type": "minnaert", "color": [0.9, 0.6, 0.3], "albedo": 0.9, "darkening": 0.4},
        "shiny": {
            "type": "minnaert",
            "color": [0.3, 0.3, 0.3],
            "albedo": 0.5,
            "darkening": 1.5,
            "mirror": 0.5,
        },
    }
    shapes = [
        rectangle([-3, 0, -4], [0, 0, 8], [6, 0, 0]) | {"material": "plain"},
        tube([-0.8, 0.02, 0.3], [0.1, 1.4, 0.2], 0.5),
        tube([0.6, 0.5, 1.2], [1.2, 0.1, -0.9], 0.4, material="shiny"),
        sphere([0.9, 1.4, -0.6], 0.5) | {"material": "dusty"},
        # Beyond every light, which it does not shade.
        tube([-3, 7, 1], [6, 0, 0], 1.5),
    ]
    return LargerScene.model_validate(
        {
            "version": 1,
            "camera": camera(position=[0.4, 3, 5], look_at=[0, 0.7, 0], width=side, height=side),
            "ambient": [0.2, 0.2, 0.2],
            "materials": materials,
            "shapes": shapes,
            "lights": [LIGHTS[light]],
            "sampling": sampled(1, 4),
            **changes,
        }
    )


@pytest.mark.parametrize(("quality", "bound"), [(SINGLE, 2.0**-15), (DOUBLE, 1e-9)], ids=["single", "double"])
@pytest.mark.parametrize("light", LIGHTS)
def test_newcomers_are_drawn_as_they_read(light: str, quality: Quality, bound: float) -> None:
    scene = larger(light)
    found = samples_of(renderer.compile_scene(renderer.load_scene(scene), quality))
    expected = np.array(Drawing(scene).samples())
    differ = (np.abs(found - expected) > bound * np.maximum(1, expected)).any(axis=(2, 3))
    # Where a sample lies on a border of a shadow, rounding decides.
    assert np.count_nonzero(differ) <= (0 if quality is DOUBLE else 1)
    assert expected.max() > 0.3


@pytest.mark.slow
@pytest.mark.parametrize("lens", [0.0, 0.1], ids=["pinhole", "lens"])
@pytest.mark.parametrize("light", LIGHTS)
def test_newcomers_keep_a_target(light: str, lens: float) -> None:
    """As near as target quality keeps the kinds that it knows."""
    view = camera(position=[0.4, 3, 5], look_at=[0, 0.7, 0], width=28, height=28, lens_radius=lens)

    def shown(quality: Quality, seed: int) -> np.ndarray:
        scene = larger(light, camera=view, sampling={"seed": seed})
        return clipped(renderer.render(renderer.compile_scene(renderer.load_scene(scene), quality)).image)

    many = FixedQuality.model_validate(
        {
            "mode": "fixed",
            "antialiasing": {"pattern": "sobol", "samples": 128},
            "light": {"pattern": "sobol", "samples": 1},
        }
    )
    one, other = shown(many, 1), shown(many, 2)
    error = 2 / 255
    picture = shown(TargetQuality(mode="target", error=error), 3)
    assert root_of_product(picture - one, picture - other) <= 1.25 * error


@pytest.mark.parametrize("place", [(9, 9), (17, 15), (15, 8), (4, 20)], ids=str)
def test_newcomers_are_explained(place: tuple[int, int]) -> None:
    """The contributions of an inspection add up to the pixel."""
    scene = renderer.load_scene(larger("lamp"))
    found = inspect(inspection_plan(scene, None), *place)
    ray = found.ray
    assert ray.surface is not None
    total = np.array(ray.surface.ambient) + sum(np.add(x.diffuse, x.specular) for x in ray.surface.lights)
    total = total + sum(np.multiply(following.weight, following.radiance) for following in ray.rays)
    assert total == pytest.approx(np.array(ray.radiance), rel=1e-6)
    picture = renderer.render(renderer.compile_scene(scene)).image
    assert picture[place[1], place[0]] == pytest.approx(np.array(ray.radiance), abs=1e-5)


def test_grader_knows_mistakes_with_newcomers() -> None:
    """Programs that shade or shadow wrongly are told from right ones."""
    scene = larger("bulb")
    plan = renderer.compile_scene(renderer.load_scene(scene))
    right = renderer.render(plan).image
    found = {cause: renderer.render(change(plan)).image for cause, change in altered_shading(scene)}
    assert {"shadows_missing", "normals_flipped", "halfway_vector", "cosine_not_clamped"} <= set(found)
    assert all(np.isfinite(image).all() for image in found.values())
    for cause in ("shadows_missing", "normals_flipped", "halfway_vector"):
        assert np.abs(found[cause] - right).max() > 0.01, cause


def test_newcomer_that_is_no_surface_is_refused() -> None:
    with pytest.raises(TypeError, match=r"Tube .*Surface"):
        registered(Tube, {Tube: MINNAERT})
    with pytest.raises(TypeError, match="Minnaert"):
        registered(PhongMaterial | Minnaert, {PhongMaterial: MATERIALS[PhongMaterial]})


def test_displacement_of_a_newcomer_is_refused() -> None:
    """It would not be in the picture, beside shapes that can be displaced."""
    scene = larger("bulb")
    raised = phong(displacement_map="bumps", displacement_height=0.1)
    document = scene.model_dump(exclude_unset=True) | {
        "materials": dict.fromkeys(("plain", "dusty", "shiny"), raised),
        "textures": {"bumps": {"type": "image", "asset": "white.png"}},
    }
    loaded = renderer.load_scene(LargerScene.model_validate(document), assets=Files(PNGS))
    with pytest.raises(TypeError, match="Tube cannot be displaced"):
        renderer.compile_scene(loaded)


@pytest.mark.parametrize("seed", range(1000, 1024))
def test_shadows_by_segments_are_those_of_every_family(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The slow way of new kinds, on the kinds that have a faster one."""
    for kind, effect in SHAPES.items():
        monkeypatch.setitem(SHAPES, kind, replace(effect, cast=cast_by_segments))
    for each in compared(seed, few=True):
        assert each.different == each.explained, each
