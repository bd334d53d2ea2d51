"""Layers say what `trace` says of the rays through the pixels' centres, and cost nothing unless requested."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray

import renderer
from renderer.math.arrays import lengths
from renderer.tiling import tiles
from schemas.api.layers import LAYER_NAMES
from tests.documents import Json, bulb, camera, phong, rectangle, sampled, scene, sphere
from tests.pictures import pictures
from tests.pictures.parts import Files, png, same
from tests.pictures.random_scenes import accepted, scenes

FILES = {"picture.png": png(pictures.codes(6, 5)), "bumps.png": png(pictures.bumps())}
SAMPLED = ("samples", "error")
CENTRES = tuple(name for name in LAYER_NAMES if name not in SAMPLED)
TRACED = ("position", "normal", "uv", "shape", "primitive")
HILL: Json = {
    "type": "mesh",
    "vertices": [[-1, 0.2, -1], [1, 0.3, -1], [1, 0.1, 1], [-1, 0.4, 1], [0, 1.5, 0]],
    "triangles": [[4, 1, 0], [4, 2, 1], [4, 3, 2], [4, 0, 3]],
    "material": "plain",
    "smooth": True,
}
DRAWN: dict[str, Json] = {
    "room": pictures.of_room(),
    "many lights": pictures.many_lights() | {"sampling": sampled(5, 7, "random", "random", seed=9)},
    "smooth": pictures.smooth(),
    "normal map": pictures.carved(),
    "picture": pictures.textured(wrap="mirror"),
    "mesh": scene(HILL, sphere([0.4, 1.2, 0.9], 0.3), lights=[bulb([1, 3, 2])]),
    "nothing in view": scene(sphere([0, 0, 90], 0.1), lights=[bulb([1, 3, 2])]),
}


def plan_with(document: Json, layers: Any = LAYER_NAMES, width: int = 61, height: int = 43) -> Any:
    sized = {**document, "camera": {**document["camera"], "width": width, "height": height}}
    return renderer.compile_scene(renderer.load_scene(sized, assets=Files(FILES)), layers=layers)


def layers_of(document: Json, **options: Any) -> dict[str, NDArray[Any]]:
    return renderer.render(plan_with(document), **options).layers


def centre_rays(plan: renderer.RenderPlan) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    rows, columns = np.mgrid[: plan.height, : plan.width] + 0.5
    directions = plan.camera.directions(columns.ravel(), rows.ravel())
    return np.broadcast_to(plan.camera.position, directions.shape).T, directions.T


@pytest.mark.parametrize("name", DRAWN)
def test_layers_equal_traced_centres(name: str) -> None:
    plan = plan_with(DRAWN[name])
    layers = renderer.render(plan).layers
    origins, directions = centre_rays(plan)
    hits = renderer.trace(plan, origins, directions)
    for part in TRACED:
        assert same(getattr(hits, part).astype(layers[part].dtype).reshape(layers[part].shape), layers[part])
    depth = (hits.t * lengths(directions.T)).astype(np.float32)
    assert same(depth.reshape(43, 61), layers["depth"])
    # The same along unit rays, but for a rounding: float32's half spacing and some of float64.
    unit = directions / np.linalg.norm(directions, axis=1)[:, None]
    along = renderer.trace(plan, origins, unit).t.reshape(43, 61)
    seen = np.isfinite(layers["depth"])
    assert np.array_equal(seen, np.isfinite(along))
    assert np.all(np.abs(layers["depth"][seen] - along[seen]) <= 2.0**-23 * along[seen])


@pytest.mark.slow
@given(scenes().filter(accepted))
@settings(max_examples=60)
def test_layers_of_random_scenes(document: Json) -> None:
    plan = plan_with(document, width=9, height=7)
    layers = renderer.render(plan, tile_size=4).layers
    hits = renderer.trace(plan, *centre_rays(plan))
    for part in TRACED:
        assert same(getattr(hits, part).astype(layers[part].dtype).reshape(layers[part].shape), layers[part])


def test_layers_of_a_wall() -> None:
    """A wall 3 before a camera that looks straight at it, with an opening of 90 degrees: 6 high, 12 wide."""
    wall = rectangle([-6, -3, 0], [12, 0, 0], [0, 6, 0])
    document = scene(
        wall,
        camera=camera(position=[0, 0, 3], look_at=[0, 0, 0], vertical_fov=90, width=16, height=8),
        materials={"plain": phong([0.25, 0.5, 0.75])},
        lights=[bulb([0, 0, 2])],
        sampling=sampled(9),
    )
    layers = layers_of_size(document, 16, 8)
    rows, columns = np.mgrid[:8, :16]
    x, y = (columns + 0.5) / 16 * 12 - 6, 3 - (rows + 0.5) / 8 * 6
    position = np.stack([x, y, np.zeros_like(x)], axis=-1)
    assert np.abs(layers["position"] - position).max() <= 12 * 2.0**-24
    assert np.abs(layers["uv"] - np.stack([(x + 6) / 12, (y + 3) / 6], axis=-1)).max() <= 2.0**-23
    assert np.allclose(layers["depth"], np.sqrt(x * x + y * y + 9), rtol=2.0**-23, atol=0)
    for part in ("normal", "shading_normal"):
        assert np.all(layers[part] == [0, 0, 1])
    assert np.all(layers["albedo"] == [0.25, 0.5, 0.75])
    assert np.all(layers["shape"] == 0)
    assert np.all(layers["samples"] == 9)


def layers_of_size(document: Json, width: int, height: int) -> dict[str, NDArray[Any]]:
    return renderer.render(plan_with(document, width=width, height=height)).layers


def test_normal_faces_the_camera() -> None:
    wall = rectangle([-9, -9, 0], [0, 18, 0], [18, 0, 0])
    document = scene(wall, camera=camera(position=[0, 0, 3], look_at=[0, 0, 0]), lights=[bulb([0, 0, 2])])
    assert np.all(layers_of(document)["normal"] == [0, 0, 1])


def test_albedo_is_the_texel() -> None:
    texels = pictures.codes(6, 5)
    picture = {"type": "image", "asset": "picture.png", "encoding": "linear", "filter": "nearest"}
    document = scene(
        rectangle([-2, -2, 0], [4, 0, 0], [0, 4, 0]),
        camera=camera(position=[0, 0, 2], look_at=[0, 0, 0], vertical_fov=90),
        textures={"picture": picture},
        materials={"plain": phong(color_texture="picture", ambient=0.5, diffuse=0.25)},
        lights=[bulb([0, 0, 2])],
    )
    layers = layers_of_size(document, 40, 40)
    u, v = layers["uv"][..., 0], layers["uv"][..., 1]
    expected = texels[((1 - v) * 6).astype(int), (u * 5).astype(int)] / np.float64(255)
    assert np.array_equal(layers["albedo"], expected.astype(np.float32))


def test_shading_normal() -> None:
    layers = layers_of(DRAWN["normal map"])
    seen = layers["shape"] >= 0
    geometric, shading = layers["normal"][seen], layers["shading_normal"][seen]
    assert np.abs(np.linalg.norm(shading, axis=1) - 1).max() <= 2.0**-22
    assert np.count_nonzero(np.abs(geometric - shading).max(axis=1) > 0.01) > 0.5 * seen.sum()


@pytest.mark.parametrize("name", DRAWN)
def test_types_and_misses(name: str) -> None:
    layers = layers_of(DRAWN[name])
    assert tuple(layers) == LAYER_NAMES
    missed = layers["shape"] == -1
    channels = {"depth": 0, "uv": 2, "shape": 0, "primitive": 0, "samples": 0}
    for part, values in layers.items():
        whole = part in {"shape", "primitive", "samples"}
        assert values.dtype == (np.int32 if whole else np.float32)
        count = channels.get(part, 3)
        assert values.shape == ((43, 61, count) if count else (43, 61))
    for part in ("position", "normal", "shading_normal", "uv"):
        assert np.array_equal(np.isnan(layers[part]).all(axis=2), missed)
        assert np.array_equal(np.isnan(layers[part]).any(axis=2), missed)
    assert np.array_equal(np.isinf(layers["depth"]), missed)
    assert np.all(layers["albedo"][missed] == 0)
    assert np.all(layers["primitive"][missed] == 0)
    assert missed.all() == (name == "nothing in view")


def test_visible_light_hides_no_layer() -> None:
    document = DRAWN["room"]
    unlit = {**document, "lights": [{**document["lights"][0], "visible": False}]}
    with_light, without = layers_of(document), layers_of(unlit)
    assert all(same(with_light[part], without[part]) for part in CENTRES)


def test_layers_through_a_lens() -> None:
    document = DRAWN["room"]
    open_lens = {**document, "camera": {**document["camera"], "lens_radius": 0.3, "focus_distance": 4}}
    sharp, blurred = (renderer.render(plan_with(d)) for d in (document, open_lens))
    assert not same(sharp.image, blurred.image)
    assert all(same(sharp.layers[part], blurred.layers[part]) for part in CENTRES)


@pytest.mark.slow
@pytest.mark.parametrize("name", DRAWN)
def test_layers_are_free_of_tiles_and_samples(name: str) -> None:
    whole = layers_of(DRAWN[name])
    for size in (5, 64):
        small = layers_of(DRAWN[name], tile_size=size)
        assert all(same(small[part], whole[part]) for part in LAYER_NAMES), size
    other = layers_of({**DRAWN[name], "sampling": sampled(2, 1, "random", "random", seed=4)})
    assert all(same(other[part], whole[part]) for part in CENTRES)
    assert np.all(other["samples"] == 2)


def test_albedo_of_a_filtered_texture() -> None:
    board = {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0], "repeat": [90, 90], "filter": "box"}
    document = pictures.checkered() | {"textures": {"picture": board}}
    plan = plan_with(document)
    whole, small = (renderer.render(plan, tile_size=size).layers for size in (64, 7))
    assert all(same(small[part], whole[part]) for part in LAYER_NAMES)
    seen = whole["albedo"][whole["shape"] >= 0]
    assert np.count_nonzero((seen > 0.1) & (seen < 0.9)) > 0.5 * seen.size
    exact = layers_of({**document, "textures": {"picture": {**board, "filter": "none"}}})
    assert all(same(exact[part], whole[part]) for part in CENTRES if part != "albedo")


@pytest.mark.slow
def test_layers_are_free_of_workers() -> None:
    plan = plan_with(DRAWN["room"])
    alone = renderer.render(plan).layers
    shared = renderer.render(plan, workers=2, tile_size=16).layers
    assert all(same(shared[part], alone[part]) for part in LAYER_NAMES)


@pytest.mark.parametrize("name", DRAWN)
def test_layers_change_nothing_else(name: str) -> None:
    bare, requested = plan_with(DRAWN[name], layers=()), plan_with(DRAWN[name])
    plain, full = renderer.render(bare), renderer.render(requested)
    assert plain.layers == {}
    assert "layers" not in plain.report["rays"]
    assert same(plain.image, full.image)
    assert plain.report["rays"] == {k: v for k, v in full.report["rays"].items() if k != "layers"}
    assert full.report["rays"]["layers"] == 61 * 43
    own = [entry for entry in requested.entries if not entry.effect.startswith("layers")]
    assert [entry.name for entry in own] == [entry.name for entry in bare.entries]
    effects = {entry.effect for entry in requested.entries} - {entry.effect for entry in own}
    assert effects == {"layers", *(f"layers.{part}" for part in LAYER_NAMES)}


def test_layers_of_passes() -> None:
    for names, expected in (((), 0), (("depth",), 1), (("depth", "error"), 2)):
        plan = plan_with(DRAWN["room"], layers=names)
        results = [renderer.render_tile(plan, tiles(plan, pass_)[0], pass_) for pass_ in plan.passes]
        assert sum(bool(result.layers) for result in results) == expected
