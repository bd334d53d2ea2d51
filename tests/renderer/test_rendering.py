"""A whole picture: its report, its counts and its failures."""

from typing import Any

import numpy as np
import pytest

import renderer
from renderer.interaction import Rays
from tests.documents import Json, phong, rectangle, sampled, scene, sphere, sun, triangle
from tests.pictures import pictures
from tests.pictures.parts import SINGLE, Files, image_of, plan_of, png

SMALL = pictures.of_room()


def test_report_counts_rays_and_seconds() -> None:
    result = renderer.render(plan_of(SMALL))
    report = result.report
    assert (report["width"], report["height"]) == (24, 16)
    assert report["rays"]["camera"] == 24 * 16 * 4
    assert 0 < report["rays"]["shadow"] <= 24 * 16 * 4 * 9
    assert report["seconds"] >= 0
    spent = [0, *(found["cpu_seconds"] for found in report["passes"]), report["cpu_seconds"]]
    assert sorted(set(spent)) == list(dict.fromkeys(spent))
    assert spent[-2] > 0
    assert report["error"] is None
    assert report["numerics"] == {"non_finite": 0, "clamped": 0, "degenerate_dropped": 0, "retried": 0}
    assert report["plan"] == plan_of(SMALL).describe().model_dump(mode="json")
    assert (result.image.dtype, result.image.shape) == (np.float32, (16, 24, 3))


@pytest.mark.parametrize("height", [1e-13, 1e-300])
@pytest.mark.parametrize("kind", ["triangle", "mesh"])
def test_triangles_as_thin_as_rounding_are_kept(kind: str, height: float) -> None:
    thin, plain = [[0, 0, 0], [1, 0, 0], [0.5, height, 0]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    if kind == "mesh":
        mesh = {"type": "mesh", "vertices": thin + plain[2:], "triangles": [[0, 1, 2], [0, 1, 3]]}
        shapes = [mesh | {"material": "plain"}]
    else:
        shapes = [triangle(*thin), triangle(*plain)]
    numerics = renderer.render(plan_of(scene(*shapes))).report["numerics"]
    assert numerics == {"non_finite": 0, "clamped": 0, "degenerate_dropped": 0, "retried": 1}


def test_pixels_beyond_float32_are_counted() -> None:
    """An edge through the picture: the mean of a bright pass and black ones is within float32 again."""
    edge, settings = (
        rectangle([-9, -9, 0], [9, 0, 0], [2, 18, 0]),
        {"sampling": sampled(16), "background": [0] * 3},
    )
    bright = {"plain": phong([1e30] * 3, ambient=1e30)}
    plain = image_of(scene(edge, **settings))
    result = renderer.render(plan_of(scene(edge, ambient=[1e30] * 3, materials=bright, **settings)))
    shown = (plain > 0).any(axis=2)
    assert (result.image[shown] < np.finfo(np.float32).max).any()
    assert result.report["numerics"]["clamped"] == np.count_nonzero(shown)


def test_quality_given_to_render_replaces_the_plans() -> None:
    plan = plan_of(SMALL)
    again = plan_of(SMALL, SINGLE.model_copy(update={"precision": "double"}))
    changed = renderer.render(plan, again.quality).image
    assert changed.tobytes() == renderer.render(again).image.tobytes()
    assert changed.tobytes() != renderer.render(plan).image.tobytes()


class Broken:
    """A stage that fails as arithmetic or memory may."""

    def __init__(self, error: Exception) -> None:
        self.error = error

    def run(self, rays: Rays) -> None:
        raise self.error


@pytest.mark.parametrize("error", [ArithmeticError("overflow"), MemoryError("too much"), ValueError("wrong")])
def test_tile_that_fails_is_named_with_its_seed(error: Exception) -> None:
    plan: Any = plan_of({**SMALL, "sampling": {**SMALL["sampling"], "seed": 12}})
    object.__setattr__(plan, "intersectors", (Broken(error),))
    with pytest.raises(renderer.RenderError) as caught:
        renderer.render(plan, tile_size=10)
    message = str(caught.value)
    for part in ("pixels 0..10 x 0..10", "samples 0..1", "seed 12", type(error).__name__, str(error)):
        assert part in message


def test_render_stops_when_on_tile_raises() -> None:
    class EnoughError(Exception):
        pass

    def stop(event: renderer.TileEvent) -> None:
        raise EnoughError

    with pytest.raises(EnoughError):
        renderer.render(plan_of(SMALL), on_tile=stop)


WALL = rectangle([-9, -9, 0], [18, 0, 0], [0, 18, 0])
LEFT, RIGHT = (rectangle([x, -9, 0], [9, 0, 0], [0, 18, 0]) for x in (-9, 0))
BEHIND = rectangle([-900, -900, 50], [1800, 0, 0], [0, 1800, 0], material="painted")
BUMPY = {"bump_map": "bumps", "bump_height": 0.1}
PAINTED = {"painted": phong(color_texture="board")}


@pytest.mark.parametrize(
    ("shapes", "materials", "changes", "points", "lookups"),
    [
        ([sphere([0, 0, 90], 1)], {}, {}, 0, 0),
        ([WALL], {}, {}, 4, 0),
        ([WALL], {}, {"sampling": sampled(9)}, 9, 0),
        ([LEFT], {}, {}, 2, 0),
        ([WALL], {"plain": phong(color_texture="board")}, {}, 4, 4),
        ([WALL], {"plain": phong(normal_map="picture")}, {}, 4, 4),
        ([WALL], {"plain": phong(**BUMPY)}, {}, 4, 16),
        ([WALL], {"plain": phong(**BUMPY | {"bump_height": 0.0})}, {}, 4, 0),
        ([WALL], {"plain": phong(color_texture="board", normal_map="picture", **BUMPY)}, {}, 4, 24),
        ([LEFT, RIGHT | {"material": "painted"}], PAINTED, {}, 4, 2),
        ([WALL, BEHIND], {"plain": phong(mirror=0.5), **PAINTED}, {}, 8, 4),
        ([WALL], {"plain": phong(color_texture="board")}, {"layers": ("albedo",)}, 5, 5),
        ([WALL], {"plain": phong(color_texture="board")}, {"layers": ("samples",)}, 4, 4),
    ],
    ids=["miss", "wall", "9 samples", "half", "color", "normals", "bumps", "flat bumps", "all three",
         "two materials", "mirror", "albedo", "samples"],
)  # fmt: skip
def test_shading_points_and_lookups_are_counted_exactly(
    shapes: list[Json], materials: Json, changes: Json, points: int, lookups: int
) -> None:
    """Counts per pixel; a slope of a bump map takes four look-ups."""
    textures = {
        "picture": {"type": "image", "asset": "grey.png", "filter": "mipmap"},
        "board": {"type": "checker"},
        "bumps": {"type": "image", "asset": "grey.png", "encoding": "linear"},
    }
    document = scene(
        *shapes,
        camera={"position": [0, 0, 5], "look_at": [0, 0, 0], "width": 8, "height": 6, "vertical_fov": 30},
        lights=[sun([0, 0, -1])],
        textures=textures,
        materials={"plain": phong()} | materials,
        sampling=changes.get("sampling", sampled(4)),
    )
    files = Files({"grey.png": png(np.full((4, 4, 3), 200, dtype=np.uint8))})
    plan = renderer.compile_scene(
        renderer.load_scene(document, assets=files), layers=changes.get("layers", ())
    )
    work = renderer.render(plan, tile_size=5).report["work"]
    assert work == {"shading_points": points * 48, "texture_lookups": lookups * 48}
