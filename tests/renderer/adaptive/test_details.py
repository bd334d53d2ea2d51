"""Texture detail that is shaded apart from light, against dense samples."""

from collections import Counter
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from accuracy.hard_cases.documents import Json, camera, lamp, phong, rectangle, scene, sphere
from renderer.adaptive.rays import camera_rays
from renderer.integrator import radiance
from renderer.plan.plan import pilot_of
from schemas.quality import FixedQuality, TargetQuality
from tests.pictures.parts import Files, png

SIZE = 40
ERROR = 0.5 / 255
PANEL = rectangle([-1.5, 0, 0], [3, 0, 0], [0, 3, 0])
BALL = {**sphere([-1.0, 2.8, 1.7], 0.3), "material": "matt"}
LAMP = lamp([-2, 3.5, 2.5], [0.8, 0, 0], [0, 0, 0.8])
VIEW = camera(position=[0.4, 1.4, 4.5], look_at=[0.0, 1.5, 0.0], width=SIZE, height=SIZE, vertical_fov=32)
IMAGE = {"type": "image", "filter": "bilinear", "wrap": "repeat"}
COLORS, NORMALS = {**IMAGE, "asset": "colors.png"}, {**IMAGE, "asset": "normals.png", "encoding": "linear"}
HEIGHTS = {**IMAGE, "asset": "heights.png", "encoding": "linear"}
MATERIALS = {
    "color": {"color": None, "color_texture": "colors"},
    "normal": {"normal_map": "normals"},
    "bump": {"bump_map": "heights", "bump_height": 0.05},
    "color and normal": {"color": None, "color_texture": "colors", "normal_map": "normals"},
    "color and bump": {"color": None, "color_texture": "colors", "bump_map": "heights", "bump_height": 0.05},
}


def files() -> Files:
    """Images of 64 x 64 texels, some 2 of which a pixel covers along either axis."""
    random = np.random.default_rng(3)
    blocks = random.integers(0, 256, (16, 16, 3)).repeat(4, axis=0).repeat(4, axis=1)
    waves = np.sin(np.arange(64) * np.pi / 8)
    tilts = np.stack(np.broadcast_arrays(waves[:, None] * 60 + 128, waves * 60 + 128, 230.0), axis=2)
    hills = np.broadcast_to(((waves[:, None] + waves) * 60 + 128)[:, :, None], (64, 64, 3))
    named = {"colors": blocks, "normals": tilts, "heights": hills}
    return Files({f"{name}.png": png(values.astype(np.uint8)) for name, values in named.items()})


def panel(material: Json, *shapes: Json, lights: list[Json] | None = None) -> renderer.LoadedScene:
    parts = phong(color=[0.7, 0.6, 0.5], specular=0.4, shininess=30) | material
    parts = {name: value for name, value in parts.items() if value is not None}
    names = {parts.get(name) for name in ("color_texture", "normal_map", "bump_map")}
    textures = {"colors": COLORS, "normals": NORMALS, "heights": HEIGHTS}
    document = scene(
        PANEL,
        *shapes,
        lights=lights or [LAMP],
        camera=VIEW,
        textures={name: value for name, value in textures.items() if name in names},
        materials={"plain": parts, "matt": phong()},
    )
    return renderer.load_scene(document, assets=files())


def plan_of(loaded: renderer.LoadedScene, error: float = ERROR, **options: Any) -> renderer.RenderPlan:
    return renderer.compile_scene(loaded, TargetQuality(mode="target", error=error, **options))


def first_values(loaded: renderer.LoadedScene) -> NDArray[np.float64]:
    """What the pass without samples finds at all pixels, (H, W, 3)."""
    pilot = pilot_of(plan_of(loaded))
    rows, columns = np.divmod(np.arange(SIZE * SIZE), SIZE)
    middle = np.full(rows.size, 0.5)
    rays = camera_rays(pilot, columns, rows, np.full(rows.size, 2), (middle, middle))
    return radiance(pilot, rays, Counter()).T.reshape(SIZE, SIZE, 3)


def dense_values(loaded: renderer.LoadedScene) -> NDArray[np.float32]:
    quality = FixedQuality.model_validate(
        {
            "mode": "fixed",
            "antialiasing": {"pattern": "uniform", "samples": 400},
            "light": {"pattern": "sobol", "samples": 16},
        }
    )
    return renderer.render(renderer.compile_scene(loaded, quality)).image


@pytest.mark.slow
@pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS.keys())
def test_texture_detail_is_the_mean_of_dense_samples(material: Json) -> None:
    loaded = panel(material)
    inside = np.s_[4:-4, 6:-6]
    found, expected = first_values(loaded)[inside], dense_values(loaded)[inside]
    assert expected.std() > 0.02
    assert np.sqrt(np.mean((found - expected) ** 2)) <= ERROR


@pytest.mark.slow
def test_texture_detail_in_a_penumbra() -> None:
    """A pixel's centre stands for all of it, and 1,024 points for the light: a smooth shadow errs little."""
    loaded = panel(MATERIALS["color and normal"], BALL)
    shaded, open_panel = dense_values(loaded), dense_values(panel(MATERIALS["color and normal"]))
    inside = np.s_[16:-10, 14:-8]
    assert np.abs(shaded - open_panel)[inside].max() > 0.1
    found = first_values(loaded)[inside]
    assert np.sqrt(np.mean((found - shaded[inside]) ** 2)) <= 2 * ERROR


@pytest.mark.parametrize("tile_size", [7, 40])
def test_texture_detail_is_free_of_tiles(tile_size: int) -> None:
    plan = plan_of(panel(MATERIALS["color and normal"], BALL), 1 / 255)
    whole = renderer.render(plan).image
    assert (renderer.render(plan, tile_size=tile_size).image == whole).all()


@pytest.mark.parametrize(
    "material",
    [
        {"color": None, "color_texture": "colors", "mirror": 0.5, "max_depth": 2},
        {"normal_map": "normals", "bump_map": "heights", "bump_height": 0.1},
    ],
    ids=["mirror", "bump map on a normal map"],
)
def test_other_variation_is_sampled(material: Json) -> None:
    names = [stage.name for stage in plan_of(panel(material)).describe().pilot_samples]
    assert "detail of plain" not in names


def test_plan_names_detailed_textures() -> None:
    stages = plan_of(panel(MATERIALS["color and normal"])).describe().pilot_samples
    (stage,) = [stage for stage in stages if stage.name == "detail of plain"]
    assert stage.pointers == ("/materials/plain/color_texture", "/materials/plain/normal_map")
    assert not any(stage.name.startswith("detail") for stage in plan_of(panel({})).describe().pilot_samples)
