"""The textbooks' formulas draw the pictures that Penumbra draws, so that the two are timed at equal work."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from benchmarks import effects, kernels
from benchmarks.references import PATHS
from benchmarks.settings import Setting
from benchmarks.stability import ASIDE, PRICED, WAYS
from benchmarks.textbook.plans import factored, textbook
from renderer.integrator import camera_rays, intersect, workspace
from renderer.plan.plan import RenderPlan
from renderer.tiling import blocks, tiles

SIDE = 160
LIGHT_POINTS = 64
STRAY = 1e-3
"""Rays that pass an edge closer than float32 resolves, 1e-6 of a picture's side, may go either way, and
some ten edges cross a picture. A thousand times as many pixels are let pass, and a formula that is wrong
changes a hundred times as many again."""

Json = dict[str, Any]
Replaced = Callable[[RenderPlan], RenderPlan]


@pytest.fixture(autouse=True)
def _as_careless_as_a_textbook() -> Iterator[None]:
    with np.errstate(all="ignore"):
        yield


def study(name: str) -> Json:
    """A study scene whose camera stands aside, so that no ray hits the very edge of a wall."""
    document: Json = json.loads(PATHS[name].read_text())
    for field in ("position", "look_at"):
        document["camera"][field] = np.add(document["camera"][field], ASIDE).tolist()
    return document


def plain(*shapes: Json) -> Json:
    """Shining shapes in front of a lamp that stands upright."""
    shine = {"type": "phong", "color": [0.8, 0.7, 0.6], "diffuse": 1, "specular": 0.4, "shininess": 5}
    lamp = {"type": "rectangle", "corner": [-1, 0.5, -3], "edges": [[2, 0, 0], [0, 3, 0.3]]}
    return {
        "version": 1,
        "camera": {"position": [0.1, 2.2, 6], "look_at": [0, 0.8, 0], "vertical_fov": 40},
        "materials": {"shine": shine},
        "shapes": [{**shape, "material": "shine"} for shape in shapes],
        "lights": [lamp | {"color": [1, 1, 1]}],
    }


BALL = {"type": "ellipsoid", "center": [0, 1, 0], "radius": 0.8}
FLOOR = {"type": "rectangle", "corner": [-3, -0.1, -3], "edges": [[0, 0, 6], [6, 0, 0]]}
BOARD = {"type": "rectangle", "corner": [-0.8, 0.3, -1.6], "edges": [[1.1, 0, 0.2], [0, 0.7, 0]]}

SCENES = {
    "soft": study("soft"),
    "chess": study("chess"),
    "a board in the light": plain(FLOOR, BOARD),
    "a ball that nothing shades": plain(BALL),
}


def small(name: str) -> RenderPlan:
    """A scene with few pixels, of one sample each."""
    document = SCENES[name]
    sized = document | {"camera": document["camera"] | {"width": SIDE, "height": SIDE}}
    quality = Setting(name, "uniform", 1, "uniform", LIGHT_POINTS).quality
    return renderer.compile_scene(sized, quality)


def image(plan: RenderPlan) -> NDArray[np.float64]:
    return renderer.render(plan).image.astype(np.float64)


@pytest.mark.parametrize("replaced", [textbook, factored])
@pytest.mark.parametrize("name", SCENES)
def test_the_picture_is_the_same_but_for_a_light_point_that_is_seen_or_not(
    name: str, replaced: Replaced
) -> None:
    plan = small(name)
    off = np.abs(image(replaced(plan)) - image(plan)).max(axis=2)
    # What one light point adds at most: its share of white light, by white and by a highlight of 0.4.
    one = 1.4 / LIGHT_POINTS
    assert np.mean(off > one) <= STRAY
    assert np.median(off) <= 64 * np.finfo(np.float32).eps


@pytest.mark.parametrize("replaced", [textbook, factored])
def test_all_that_is_formed_on_the_way_is_float32(replaced: Replaced) -> None:
    plan = replaced(small("soft"))
    block = next(blocks(tiles(plan, plan.passes[1])[0], plan.passes[1]))
    rays = camera_rays(plan, block, plan.passes[1])
    points = intersect(plan, rays, lights=False)
    view = plan.lightings[0].view(points, workspace())
    formed = [rays.origins, rays.directions, view.towards]
    formed += [getattr(points, name) for name in ("positions", "normals", "viewers", "colors", "radiance")]
    assert {array.dtype for array in formed} == {np.dtype(np.float32)}


@pytest.mark.parametrize("replaced", [textbook, factored])
def test_no_kernel_with_a_formula_in_the_textbooks_is_left_in_place(replaced: Replaced) -> None:
    plan = PRICED[0].plan()
    kept = {type(stage) for stage in _parts(plan)} & {type(stage) for stage in _parts(replaced(plan))}
    # Phong's terms are formed in the dtype of the points, and `factored` only wants them in float32.
    allowed = {"Colors", "Ambient"} | ({"Diffuse", "Highlight"} if replaced is factored else set())
    assert {kind.__name__ for kind in kept} == allowed


def _parts(plan: RenderPlan) -> list[Any]:
    """Stages, and for those of hits and places the family that does the work."""
    light = plan.lightings[0]
    hits = (*plan.intersectors, *plan.visible_lights, *plan.surfaces)
    families = [getattr(stage, "rectangles", getattr(stage, "family", stage)) for stage in hits]
    return [plan.camera, light.emitter, *families, *light.shadows, *light.terms]


def test_rays_through_a_tree_hit_the_same_places() -> None:
    plan = kernels.of_many_triangles()
    plan = dataclasses.replace(plan, camera=dataclasses.replace(plan.camera, width=SIDE, height=SIDE))
    ours, theirs = (_distances(replaced(plan)) for replaced in (WAYS["penumbra"], textbook))
    assert np.mean(np.isfinite(ours)) > 0.1
    assert np.mean(np.isfinite(ours) != np.isfinite(theirs)) <= STRAY
    both = np.isfinite(ours) & np.isfinite(theirs)
    assert np.mean(np.abs(theirs[both] / ours[both] - 1) > 2.0**-16) <= STRAY


def _distances(plan: RenderPlan) -> NDArray[np.float64]:
    """Of the nearest hits, scene units: not every camera has directions of length 1."""
    found = []
    for tile in tiles(plan, plan.passes[1]):
        for block in blocks(tile, plan.passes[1]):
            rays = camera_rays(plan, block, plan.passes[1])
            for stage in plan.intersectors:
                stage.run(rays)
            found.append(rays.t * np.linalg.norm(rays.directions, axis=0))
    return np.concatenate(found)


@pytest.mark.parametrize("replaced", [textbook, factored])
def test_what_has_no_formula_here_is_refused(replaced: Replaced) -> None:
    with pytest.raises(ValueError, match="no textbook formulas for smooth normals"):
        replaced(effects.plan_of({"material": {"mirror": 0.4}}))


def test_light_points_of_their_own_have_no_factored_form() -> None:
    plan = Setting("soft", "stratified", 1, "stratified", 4).plan()
    assert textbook(plan).lightings
    with pytest.raises(ValueError, match="not factored"):
        factored(plan)
