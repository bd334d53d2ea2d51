"""Fine textures at target quality: colour, normal and bump maps of two texels a pixel."""

from collections import Counter
from functools import cache
from typing import Any

import numpy as np
import pytest

import renderer
from renderer.adaptive.target_plan import TargetPlan
from renderer.halves import HALVES
from renderer.integrator import radiance, rays_through
from renderer.plan import effects
from schemas.quality import TargetQuality
from tests.documents import Json, camera, lamp, phong, rectangle, scene, sphere
from tests.pictures.parts import Files, png
from tests.pictures.references import CONVERGED, root_of_product
from tests.renderer.plan.newcomers import MINNAERT, LargerScene, Minnaert

SIZE = 40
ERROR = 1 / 255
SEEDS = range(3)
PANEL = rectangle([-1.5, 0, 0], [3, 0, 0], [0, 3, 0])
BALL = {**sphere([-1.0, 2.8, 1.7], 0.3), "material": "matt"}
LAMP = lamp([-2, 3.5, 2.5], [0.8, 0, 0], [0, 0, 0.8])
VIEW = camera(position=[0.4, 1.4, 4.5], look_at=[0.0, 1.5, 0.0], width=SIZE, height=SIZE, vertical_fov=32)
IMAGE = {"type": "image", "filter": "bilinear", "wrap": "repeat"}
TEXTURES = {
    "colors": {**IMAGE, "asset": "colors.png"},
    "normals": {**IMAGE, "asset": "normals.png", "encoding": "linear"},
    "heights": {**IMAGE, "asset": "heights.png", "encoding": "linear"},
}
COLOR: Json = {"color": None, "color_texture": "colors"}
MATERIALS: dict[str, Json] = {
    "color": COLOR,
    "normal": {"normal_map": "normals"},
    "bump": {"bump_map": "heights", "bump_height": 0.05},
    "color and normal": {**COLOR, "normal_map": "normals"},
    "sharp highlight": {**COLOR, "normal_map": "normals", "shininess": 500},
    "color and bump": {**COLOR, "bump_map": "heights", "bump_height": 0.05},
    "normal and bump": {"normal_map": "normals", "bump_map": "heights", "bump_height": 0.1},
    "mirror": {**COLOR, "mirror": 0.5, "max_depth": 2},
    "newcomer": {
        **COLOR,
        **dict.fromkeys(("diffuse", "specular", "shininess")),
        "normal_map": "normals",
        "type": "minnaert",
        "albedo": 0.9,
        "darkening": 0.4,
    },
}


@pytest.fixture(autouse=True)
def newcomer(monkeypatch: pytest.MonkeyPatch) -> None:
    """One line."""
    monkeypatch.setitem(effects.MATERIALS, Minnaert, MINNAERT)


def files() -> Files:
    """Images of 64 x 64 texels, some 2 of which a pixel covers along either axis."""
    random = np.random.default_rng(3)
    blocks = random.integers(0, 256, (16, 16, 3)).repeat(4, axis=0).repeat(4, axis=1)
    waves = np.sin(np.arange(64) * np.pi / 8)
    tilts = np.stack(np.broadcast_arrays(waves[:, None] * 60 + 128, waves * 60 + 128, 230.0), axis=2)
    hills = np.broadcast_to(((waves[:, None] + waves) * 60 + 128)[:, :, None], (64, 64, 3))
    named = {"colors": blocks, "normals": tilts, "heights": hills}
    return Files({f"{name}.png": png(values.astype(np.uint8)) for name, values in named.items()})


def panel(name: str, seed: int = 0, *more: Json) -> renderer.LoadedScene:
    """A panel and the penumbra of a ball on it, and more shapes."""
    material = phong(color=[0.7, 0.6, 0.5], specular=0.4, shininess=30) | MATERIALS[name]
    material = {part: value for part, value in material.items() if value is not None}
    names = {material.get(part) for part in ("color_texture", "normal_map", "bump_map")}
    document = scene(
        PANEL,
        BALL,
        *more,
        lights=[LAMP],
        camera=VIEW,
        textures={part: value for part, value in TEXTURES.items() if part in names},
        materials={"plain": material, "matt": phong(), "glossy": phong(mirror=0.7)},
        sampling={"seed": seed},
    )
    return renderer.load_scene(LargerScene.model_validate(document), assets=files())


def rendered(name: str, seed: int, **options: int) -> renderer.RenderResult:
    return renderer.render(
        renderer.compile_scene(panel(name, seed), TargetQuality(mode="target", error=ERROR)), **options
    )


@cache
def references(name: str) -> list[Any]:
    """Two converged pictures whose noise is independent."""
    plans = [renderer.compile_scene(panel(name, seed), CONVERGED) for seed in (1001, 1002)]
    return [np.clip(renderer.render(plan).image, 0, 1) for plan in plans]


AVERAGED = [name for name in MATERIALS if name != "mirror"]


@pytest.mark.slow
@pytest.mark.parametrize("name", AVERAGED)
def test_pilot_samples_show_means_over_pixels(name: str) -> None:
    """One ray a pixel is as good as hundreds, so that fine texture is not sampled."""
    plan = renderer.compile_scene(panel(name), TargetQuality(mode="target", error=ERROR))
    assert isinstance(plan, TargetPlan)
    assert plan.pilot is not None
    pilot = plan.pilot
    rows, columns = np.divmod(np.arange(SIZE * SIZE), SIZE)
    middle = np.full(rows.size, 0.5)
    rays = rays_through(pilot, columns, rows, np.full(rows.size, HALVES), (middle, middle))
    values = radiance(pilot, rays, Counter()).T.reshape(SIZE, SIZE, 3)
    first, second = references(name)
    inside = np.s_[12:-4, 6:-6]
    assert (rays.shapes.reshape(SIZE, SIZE)[inside] == 0).all()
    away = np.clip(values, 0, 1)[inside]
    error = root_of_product(away - first[inside], away - second[inside])
    assert error <= ERROR, error * 255


@pytest.mark.slow
@pytest.mark.parametrize("name", MATERIALS)
def test_fine_texture_keeps_the_target(name: str) -> None:
    first, second = references(name)
    assert first[4:-4, 6:-6].std() > 0.02
    for seed in SEEDS:
        image = np.clip(rendered(name, seed).image, 0, 1)
        assert root_of_product(image - first, image - second) <= 1.25 * ERROR


@pytest.mark.slow
def test_fine_texture_in_a_mirror_keeps_the_target() -> None:
    """Rays to what it shows begin at many places, not at the camera."""
    side = {**rectangle([0.9, 0, 0], [0, 0, 1.5], [0, 3, 0]), "material": "glossy"}
    scenes = [panel("sharp highlight", seed, side) for seed in (1001, 1002, 1)]
    first, second = (
        np.clip(renderer.render(renderer.compile_scene(each, CONVERGED)).image, 0, 1) for each in scenes[:2]
    )
    target = TargetQuality(mode="target", error=2 / 255)
    image = np.clip(renderer.render(renderer.compile_scene(scenes[2], target)).image, 0, 1)
    assert root_of_product(image - first, image - second) <= 1.25 * target.error


@pytest.mark.slow
@pytest.mark.parametrize("tile_size", [7, 40])
def test_fine_texture_is_free_of_tiles(tile_size: int) -> None:
    whole = rendered("color and normal", 0).image
    assert rendered("color and normal", 0, tile_size=tile_size).image.tobytes() == whole.tobytes()
