"""What a picture must not depend on, to the bit: tiles, order, culling, units."""

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

import renderer
from renderer.film import compose
from renderer.tiling import tiles
from tests.documents import Json, mesh, phong, sampled, scene
from tests.pictures import pictures
from tests.pictures.parts import DOUBLE, SINGLE, image_of, plan_of, png, same
from tests.pictures.placed_scenes import placed
from tests.pictures.random_scenes import accepted, scenes
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
    "sharp highlights": pictures.gloss(700),
    "normal map": pictures.carved(),
    "picture": pictures.textured(wrap="mirror"),
    "falloff": pictures.of_room(lights=[pictures.CEILING_LAMP | {"falloff": "physical"}]),
    "displaced": scene(pictures.FLOOR, BALL, lights=[pictures.CEILING_LAMP], **RELIEF),
}


BOTH = [
    *((name, SINGLE) for name in DRAWN),
    *((name, DOUBLE) for name in ("sobol", "random", "sharp highlights", "falloff")),
]
IDS = [f"{name}, {quality.precision}" for name, quality in BOTH]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "precision"), BOTH, ids=IDS)
def test_pixels_are_free_of_tiles(name: str, precision: Any) -> None:
    plan = plan_of(wide(DRAWN[name], 69, 37), precision, files=FILES)
    whole = renderer.render(plan, tile_size=69).image
    for size in (7, 16, 32, 64, 256):
        assert same(renderer.render(plan, tile_size=size).image, whole), size


@pytest.mark.slow
@pytest.mark.parametrize(("name", "precision"), BOTH, ids=IDS)
def test_pixels_are_free_of_neighbours(name: str, precision: Any) -> None:
    """Tiles of one pixel: the shortest arrays there are."""
    plan = plan_of(wide(DRAWN[name], 11, 8), precision, files=FILES)
    whole = renderer.render(plan).image
    assert same(renderer.render(plan, tile_size=1).image, whole)


@pytest.mark.parametrize("name", ["random", "sobol"])
def test_passes_in_any_order(name: str) -> None:
    plan = plan_of(wide(DRAWN[name], 20, 10))
    expected = renderer.render(plan).image
    rounds = plan.passes[1:]
    (tile,) = tiles(plan, rounds[0], 64)
    for order in itertools.permutations(rounds):
        parts = {pass_.index: renderer.render_tile(plan, tile, pass_).pixels for pass_ in order}
        assert same(compose([(pass_, parts[pass_.index]) for pass_ in rounds]), expected)


@pytest.mark.parametrize("name", DRAWN)
def test_preview_shows_first_samples(name: str) -> None:
    plan = plan_of(wide(DRAWN[name], 75, 53), files=FILES)
    coarse, first = plan.passes[0], plan.passes[1]
    (whole,) = tiles(plan, coarse)
    preview = renderer.render_tile(plan, whole, coarse).pixels
    fine = renderer.render_tile(plan, whole, first).pixels
    assert (first.first, first.last) == (0, 1)
    assert coarse.stride > 1
    assert same(preview, np.ascontiguousarray(fine[:: coarse.stride, :: coarse.stride]))


def test_preview_is_reported_first() -> None:
    plan = plan_of(wide(DRAWN["random"], 40, 30))
    events: list[renderer.TileEvent] = []
    watched = renderer.render(plan, on_tile=events.append, tile_size=16)
    assert same(watched.image, renderer.render(plan).image)
    assert events[0].pass_ == plan.passes[0]
    assert events[0].pixels.shape == (30, 40, 3)
    assert [event.done for event in events] == list(range(1, len(events) + 1))
    assert {event.total for event in events} == {len(events)}


def test_tile_events_paint_the_picture() -> None:
    plan = plan_of(wide(DRAWN["random"], 40, 30))
    canvas = np.full((30, 40, 3), np.nan, dtype=np.float32)

    def paint(event: renderer.TileEvent) -> None:
        canvas[event.tile.y0 : event.tile.y1, event.tile.x0 : event.tile.x1] = event.pixels

    assert same(renderer.render(plan, on_tile=paint, tile_size=16).image, canvas)


@pytest.mark.parametrize("name", DRAWN)
def test_culling_changes_nothing(name: str) -> None:
    document = wide(DRAWN[name], 75, 53)
    for precision in (SINGLE, DOUBLE):
        culled = image_of(document, precision, files=FILES)
        assert same(culled, image_of(document, precision, files=FILES, culling=False))


@pytest.mark.slow
@given(scenes().filter(accepted))
@settings(max_examples=300)
def test_culling_in_random_scenes(document: Json) -> None:
    culled = image_of(document)
    assert np.isfinite(culled).all()
    assert same(culled, image_of(document, culling=False))


@pytest.mark.slow
@given(scenes().filter(accepted))
@settings(max_examples=60)
def test_random_scenes_are_free_of_tiles(document: Json) -> None:
    plan = plan_of(document)
    assert same(renderer.render(plan, tile_size=5).image, renderer.render(plan).image)


@pytest.mark.parametrize("exponent", [-66, -20, 40])
@pytest.mark.parametrize("name", DRAWN)
def test_units_of_a_power_of_two(name: str, exponent: int) -> None:
    document = DRAWN[name]
    scaled = placed(document, 2.0**exponent)
    assert same(image_of(scaled, files=FILES), image_of(document, files=FILES))


@pytest.mark.slow
@given(scenes().filter(accepted))
@settings(max_examples=60)
def test_random_scenes_have_no_unit(document: Json) -> None:
    assert same(image_of(placed(document, 2.0**-30)), image_of(document))


@pytest.mark.parametrize("order", [(0, 2, 1), (1, 0, 2), (2, 1, 0), (1, 2, 0)])
@pytest.mark.parametrize("name", ["smooth", "textured", "room"])
def test_order_of_vertices(name: str, order: tuple[int, ...]) -> None:
    """Front or back, left or right. Weights add up in another order: a few roundings."""
    document = {"smooth": pictures.smooth(), "textured": pictures.textured(), "room": pictures.of_room()}[
        name
    ]
    for shape in document["shapes"]:
        if shape["type"] == "triangle":
            corners = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
            for part in ("vertices", "normals", "uvs"):
                given_ = shape.get(part, [list(c) for c in corners] if part == "uvs" else None)
                if given_ is not None:
                    shape[part] = [given_[i] for i in order]
    original = {"smooth": pictures.smooth(), "textured": pictures.textured(), "room": pictures.of_room()}[
        name
    ]
    changed, before = (image_of(d, DOUBLE, files=FILES) for d in (document, original))
    assert np.abs(changed - before).max() <= 2.0**-20


BLACK = {"type": "rectangle", "corner": [0, 3, 0], "edges": [[1, 0, 0], [0, 0, 1]], "color": [0, 0, 0]}


def _added(part: str, item: Any) -> Any:
    def change(document: Json) -> Json:
        old = document.get(part, {})
        return {**document, part: {**old, **item} if isinstance(old, dict) else [*old, *item]}

    return change


WITHOUT_EFFECT = {
    "black lamp out of sight": _added("lights", [BLACK | {"visible": False}]),
    "black bulb": _added("lights", [{"type": "point", "position": [0, 3, 0], "color": [0, 0, 0]}]),
    "black sun": _added("lights", [{"type": "directional", "direction": [0, -3, 0], "color": [0, 0, 0]}]),
    "texture of no material": _added("textures", {"spare": {"type": "checker"}}),
    "material of no shape": _added("materials", {"spare": phong(color_texture="lost", normal_map="lost")}),
    "triangle without area": _added(
        "shapes", [{"type": "triangle", "vertices": [[0, 0, 0], [1, 1, 1], [3, 3, 3]], "material": "plain"}]
    ),
}


@pytest.mark.parametrize("name", WITHOUT_EFFECT)
def test_what_has_no_effect_changes_no_byte(name: str) -> None:
    plain = pictures.of_room(sampling=sampled(4, 4, "random", "random"))
    document = WITHOUT_EFFECT[name](plain)
    if "lost" in str(document):
        document["textures"] = {"lost": {"type": "image", "asset": "nowhere.png"}}
    plan, expected = plan_of(document), plan_of(plain)
    assert same(renderer.render(plan).image, renderer.render(expected).image)
    assert len(plan.left_out) > len(expected.left_out)
    assert [entry.name for entry in plan.entries] == [entry.name for entry in expected.entries]


def test_mirrored_scene() -> None:
    """To rounding: edges would add up in another order."""
    document = pictures.skew()

    def mirrored(value: Any) -> Any:
        if isinstance(value, list) and len(value) == 3 and not isinstance(value[0], list):
            return [-value[0], *value[1:]]
        return [mirrored(item) for item in value] if isinstance(value, list) else value

    parts = ("corner", "edges", "position", "look_at")

    def turned(item: Json) -> Json:
        return {k: mirrored(v) if k in parts else v for k, v in item.items()}

    other = {
        **document,
        "camera": turned(document["camera"]),
        "shapes": [turned(shape) for shape in document["shapes"]],
        "lights": [turned(light) for light in document["lights"]],
    }
    assert np.abs(image_of(other, DOUBLE)[:, ::-1] - image_of(document, DOUBLE)).max() <= 2.0**-20
