"""Layers say what `trace` says of the rays through the pixels' centres, and cost nothing unless requested."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import renderer
from renderer.math.arrays import lengths
from renderer.tiling import tiles
from schemas.api.layers import LAYER_NAMES
from tests.documents import Json, bulb, camera, phong, rectangle, sampled, scene, sphere
from tests.pictures import pictures
from tests.pictures.parts import Files, png, same

FILES = {"picture.png": png(pictures.codes(6, 5)), "bumps.png": png(pictures.bumps())}
CENTRES = tuple(name for name in LAYER_NAMES if name not in ("samples", "error"))
TRACED = ("position", "normal", "uv", "shape", "primitive")
DRAWN: dict[str, Json] = {
    "many lights": pictures.many_lights() | {"sampling": sampled(5, 7, "random", "random", seed=9)},
    "smooth": pictures.smooth(),
    "normal map": pictures.carved(),
    "picture": pictures.textured(wrap="mirror"),
    "nothing in view": scene(sphere([0, 0, 90], 0.1), lights=[bulb([1, 3, 2])]),
}
EVERY = pytest.mark.parametrize("name", DRAWN)


def plan_with(document: Json, layers: Any = LAYER_NAMES, width: int = 61, height: int = 43) -> Any:
    sized = {**document, "camera": {**document["camera"], "width": width, "height": height}}
    return renderer.compile_scene(renderer.load_scene(sized, assets=Files(FILES)), layers=layers)


def layers_of(document: Json, **options: Any) -> dict[str, NDArray[Any]]:
    return renderer.render(plan_with(document), **options).layers


@EVERY
def test_layers_equal_traced_centres(name: str) -> None:
    plan = plan_with(DRAWN[name])
    layers = renderer.render(plan).layers
    rows, columns = np.mgrid[:43, :61] + 0.5
    directions = plan.camera.directions(columns.ravel(), rows.ravel())
    origins = np.broadcast_to(plan.camera.position, directions.shape).T
    hits = renderer.trace(plan, origins, directions.T)
    for part in TRACED:
        assert same(getattr(hits, part).astype(layers[part].dtype).reshape(layers[part].shape), layers[part])
    depth = (hits.t * lengths(directions)).astype(np.float32)
    assert same(depth.reshape(43, 61), layers["depth"])


def test_layers_of_a_wall() -> None:
    """A wall 3 before a camera that looks straight at it, with an opening of 90 degrees: 6 high, 12 wide."""
    document = scene(
        rectangle([-6, -3, 0], [12, 0, 0], [0, 6, 0]),
        camera=camera(position=[0, 0, 3], look_at=[0, 0, 0], vertical_fov=90),
        materials={"plain": phong([0.25, 0.5, 0.75])},
        sampling=sampled(9),
    )
    layers = renderer.render(plan_with(document, width=16, height=8)).layers
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


def test_albedo_of_a_filtered_texture() -> None:
    board = {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0], "repeat": [90, 90], "filter": "box"}
    filtered, exact = (
        layers_of(pictures.checkered() | {"textures": {"picture": {**board, "filter": name}}})
        for name in ("box", "none")
    )
    seen = filtered["albedo"][filtered["shape"] >= 0]
    assert np.count_nonzero((seen > 0.1) & (seen < 0.9)) > 0.5 * seen.size
    assert all(same(exact[part], filtered[part]) for part in CENTRES if part != "albedo")


@EVERY
def test_types_and_misses(name: str) -> None:
    layers = layers_of(DRAWN[name])
    assert tuple(layers) == LAYER_NAMES
    missed = layers["shape"] == -1
    assert missed.all() == (name == "nothing in view")
    channels = {"depth": 0, "uv": 2, "shape": 0, "primitive": 0, "samples": 0}
    for part, values in layers.items():
        count = channels.get(part, 3)
        assert values.dtype == (np.int32 if part in {"shape", "primitive", "samples"} else np.float32)
        assert values.shape == ((43, 61, count) if count else (43, 61))
        if part in {"position", "normal", "shading_normal", "uv"}:
            assert np.array_equal(np.isnan(values).all(axis=2), missed)
            assert np.array_equal(np.isnan(values).any(axis=2), missed)
    assert np.array_equal(np.isinf(layers["depth"]), missed)
    assert not layers["albedo"][missed].any()
    assert not layers["primitive"][missed].any()


def test_layers_are_those_of_centres_whatever_is_in_between() -> None:
    """Neither a light in view nor a lens changes them."""
    document = pictures.of_room()
    unlit = {**document, "lights": [{**document["lights"][0], "visible": False}]}
    lens = {**document, "camera": {**document["camera"], "lens_radius": 0.3, "focus_distance": 4}}
    expected = layers_of(document)
    for other in (unlit, lens):
        found = layers_of(other)
        assert all(same(found[part], expected[part]) for part in CENTRES)


@pytest.mark.slow
@EVERY
def test_layers_are_free_of_tiles_and_samples(name: str) -> None:
    whole = layers_of(DRAWN[name])
    small = layers_of(DRAWN[name], tile_size=5)
    assert all(same(small[part], whole[part]) for part in LAYER_NAMES)
    other = layers_of({**DRAWN[name], "sampling": sampled(2, 1, "random", "random", seed=4)})
    assert all(same(other[part], whole[part]) for part in CENTRES)
    assert np.all(other["samples"] == 2)


@EVERY
def test_layers_change_nothing_else(name: str) -> None:
    plain, full = (renderer.render(plan_with(DRAWN[name], layers=each)) for each in ((), LAYER_NAMES))
    assert plain.layers == {}
    assert same(plain.image, full.image)
    assert full.report["rays"] == {**plain.report["rays"], "layers": 61 * 43}


def test_layers_of_passes() -> None:
    for names, expected in (((), 0), (("depth",), 1), (("depth", "error"), 2)):
        plan = plan_with(pictures.of_room(), layers=names)
        results = [renderer.render_tile(plan, tiles(plan, pass_)[0], pass_) for pass_ in plan.passes]
        assert sum(bool(result.layers) for result in results) == expected
