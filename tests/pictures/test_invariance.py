"""Pictures are the same, to the bit, whatever the tiles, passes, culling and effects without effect."""

import itertools
import time
from typing import Any

import numpy as np
import pytest

import renderer
from renderer.film import compose
from renderer.tiling import tiles
from tests.documents import Json, bulb, camera, lamp, mesh, phong, sampled, scene, sun, triangle
from tests.pictures import pictures
from tests.pictures.parts import DOUBLE, SINGLE, Files, image_of, plan_of, png, same
from tests.solids import outward

FILES = {"picture.png": png(pictures.codes(6, 5)), "bumps.png": png(pictures.bumps())}


def wide(document: Json, width: int, height: int) -> Json:
    return {**document, "camera": {**document["camera"], "width": width, "height": height}}


BALL = mesh(*outward([0.0, 1.5, 0.0], 1, 2), smooth=True)
RELIEF: Json = {
    "textures": {"bumps": {"type": "image", "asset": "bumps.png", "encoding": "linear"}},
    "materials": {"plain": phong(displacement_map="bumps", displacement_height=0.25)},
}
DRAWN: dict[str, Json] = {
    "grid of light points": pictures.of_room(sampling=sampled(4, 16)),
    "sobol": pictures.of_room(sampling=sampled(4, 16, "sobol", "sobol", seed=3)),
    "random": pictures.many_lights() | {"sampling": sampled(5, 7, "random", "random", seed=9)},
    "stratified": pictures.smooth() | {"sampling": sampled(6, 6, "stratified", "stratified", seed=5)},
    "lens": pictures.of_room(sampling=sampled(16, 1, "sobol"))
    | {"camera": camera(lens_radius=0.4, focus_distance=3)},
    "sharp highlights": pictures.gloss(700),
    "normal map": pictures.carved(),
    "picture": pictures.textured(wrap="mirror"),
    "falloff": pictures.of_room(lights=[pictures.CEILING_LAMP | {"falloff": "physical"}]),
    "displaced": scene(pictures.FLOOR, BALL, lights=[pictures.CEILING_LAMP], **RELIEF),
    "mirror and glass": pictures.mirror_and_glass() | {"sampling": sampled(4, 4, "random", "random")},
}
EVERY = pytest.mark.parametrize("name", DRAWN)


@pytest.mark.slow
@pytest.mark.parametrize("quality", [SINGLE, DOUBLE], ids=["single", "double"])
@EVERY
def test_pixels_are_free_of_tiles(name: str, quality: Any) -> None:
    """Tiles of one pixel are the shortest arrays there are."""
    for width, height, sizes in ((69, 37, (7, 32, 256)), (11, 8, (1,))):
        plan = plan_of(wide(DRAWN[name], width, height), quality, files=FILES)
        whole = renderer.render(plan, tile_size=width).image
        for size in sizes:
            assert same(renderer.render(plan, tile_size=size).image, whole), size


@pytest.mark.parametrize("name", ["random", "sobol"])
def test_passes_in_any_order(name: str) -> None:
    plan = plan_of(wide(DRAWN[name], 20, 10))
    expected = renderer.render(plan).image
    rounds = plan.passes[1:]
    (tile,) = tiles(plan, rounds[0], 64)
    for order in itertools.permutations(rounds):
        parts = {pass_.index: renderer.render_tile(plan, tile, pass_).pixels for pass_ in order}
        assert same(compose([(pass_, parts[pass_.index]) for pass_ in rounds]), expected)


@pytest.mark.parametrize("name", ["random", "lens", "picture", "mirror and glass"])
def test_tile_in_time_slices_has_the_same_bytes(name: str) -> None:
    """Each slice is over at once, after 50 rays, in the middle of a pixel or not."""
    loaded = renderer.load_scene(wide(DRAWN[name], 37, 29), assets=Files(FILES))
    plan = renderer.compile_scene(loaded, layers=("depth", "error"))
    pass_ = plan.passes[-1]
    (whole,) = tiles(plan, pass_, 128)
    expected, slices = renderer.render_tile(plan, whole, pass_), 1
    kept = renderer.TileRendering(plan, whole, pass_).arrays()
    tile = renderer.TileRendering(plan, whole, pass_, kept | {"portion": np.array(50)})
    while not tile.run(until=0.0):
        kept = tile.arrays() | {"portion": np.array(50)}
        tile, slices = renderer.TileRendering(plan, whole, pass_, kept), slices + 1
    found = tile.result()
    assert slices > 9
    assert same(found.pixels, expected.pixels)
    assert same(found.layers["error"], expected.layers["error"])
    assert (found.counts, found.work) == (expected.counts, expected.work)


def test_rays_that_take_too_long_together_have_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    """No portion of rays that bounce is fast enough: they are followed in the smallest portions."""
    plan = plan_of(wide(DRAWN["mirror and glass"], 37, 29), files=FILES)
    pass_ = plan.passes[-1]
    (whole,) = tiles(plan, pass_, 128)
    expected = renderer.render_tile(plan, whole, pass_)
    monkeypatch.setattr("renderer.fixed_tiles.PORTION_SECONDS", 0.0)
    tile = renderer.TileRendering(plan, whole, pass_)
    assert tile.run(until=time.monotonic() + 3600)
    assert int(tile.arrays()["portion"]) < expected.pixels[..., 0].size
    found = tile.result()
    assert same(found.pixels, expected.pixels)
    assert (found.counts, found.work) == (expected.counts, expected.work)


@EVERY
def test_preview_shows_first_samples(name: str) -> None:
    plan = plan_of(wide(DRAWN[name], 75, 53), files=FILES)
    coarse, first = plan.passes[0], plan.passes[1]
    (whole,) = tiles(plan, coarse)
    preview = renderer.render_tile(plan, whole, coarse).pixels
    fine = renderer.render_tile(plan, whole, first).pixels
    assert (first.first, first.last) == (0, 1)
    assert coarse.stride > 1
    assert same(preview, np.ascontiguousarray(fine[:: coarse.stride, :: coarse.stride]))


def test_tile_events_paint_the_picture() -> None:
    plan = plan_of(wide(DRAWN["random"], 40, 30))
    canvas = np.full((30, 40, 3), np.nan, dtype=np.float32)
    events: list[renderer.TileEvent] = []

    def paint(event: renderer.TileEvent) -> None:
        events.append(event)
        canvas[event.tile.y0 : event.tile.y1, event.tile.x0 : event.tile.x1] = event.pixels

    assert same(renderer.render(plan, on_tile=paint, tile_size=16).image, canvas)
    assert events[0].pass_ == plan.passes[0]
    assert events[0].pixels.shape == (30, 40, 3)
    assert [event.done for event in events] == list(range(1, len(events) + 1))
    assert {event.total for event in events} == {len(events)}


@EVERY
def test_culling_changes_nothing(name: str) -> None:
    document = wide(DRAWN[name], 75, 53)
    for precision in (SINGLE, DOUBLE):
        culled = image_of(document, precision, files=FILES)
        assert same(culled, image_of(document, precision, files=FILES, culling=False))


LOST = {"spare": phong(color_texture="lost", normal_map="lost")}
WITHOUT_EFFECT: dict[str, Json] = {
    "black lamp out of sight": {"lights": [lamp([0, 3, 0], [1, 0, 0], [0, 0, 1], [0, 0, 0], visible=False)]},
    "black bulb": {"lights": [bulb([0, 3, 0], [0, 0, 0])]},
    "black sun": {"lights": [sun([0, -3, 0], [0, 0, 0])]},
    "texture of no material": {"textures": {"spare": {"type": "checker"}}},
    "material of no shape": {"materials": LOST, "textures": {"lost": {"type": "image", "asset": "nowhere"}}},
    "triangle without area": {"shapes": [triangle([0, 0, 0], [1, 1, 1], [3, 3, 3])]},
}


@pytest.mark.parametrize("name", WITHOUT_EFFECT)
def test_what_has_no_effect_changes_no_byte(name: str) -> None:
    plain = pictures.of_room(sampling=sampled(4, 4, "random", "random"))
    document = dict(plain)
    for part, more in WITHOUT_EFFECT[name].items():
        old = plain.get(part, {})
        document[part] = [*old, *more] if isinstance(more, list) else {**old, **more}
    plan, expected = plan_of(document), plan_of(plain)
    assert same(renderer.render(plan).image, renderer.render(expected).image)
    assert len(plan.left_out) > len(expected.left_out)
    assert [entry.name for entry in plan.entries] == [entry.name for entry in expected.entries]
