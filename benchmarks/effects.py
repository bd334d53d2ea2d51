"""What each effect costs in a scene that has it, and that it costs nothing if its strength is zero."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any, TypedDict

import renderer
from benchmarks.machine import Spread, render_seconds, spread
from benchmarks.references import SCENES
from renderer.assets import FolderAssets

Json = dict[str, Any]

SIDE = 384
"""Rows and columns of the pictures: a fifth of a second each, or a few."""

LAMP = {"type": "rectangle", "corner": [-2, 4, 0], "edges": [[1, 0, 0], [0, 0, 1]], "visible": False}
BULB = {"type": "point", "position": [2, 4, 2]}
SUN = {"type": "directional", "direction": [-0.3, -1, -0.4], "color": [0.7, 0.7, 0.7]}
GREY, BLACK = {"color": [0.3, 0.3, 0.3]}, {"color": [0, 0, 0]}

TEXTURES: Json = {
    "board": {"type": "checker", "repeat": [40, 40]},
    "boxed": {"type": "checker", "repeat": [40, 40], "filter": "box"},
    "picture": {"type": "image", "asset": "textures/tiles.png"},
    "pyramid": {"type": "image", "asset": "textures/tiles.png", "filter": "mipmap"},
    "normals": {"type": "image", "asset": "textures/tiles_normal.png", "encoding": "linear"},
    "heights": {"type": "image", "asset": "textures/tiles_height.png", "encoding": "linear"},
}


@dataclass(frozen=True)
class Effect:
    """An effect, and three scenes about it: each a base scene with some changes.

    Attributes
    ----------
    name : str
    asked : dict
        Changes that ask for it.
    zero : dict or None
        The same with strength zero, which must be the scene without it; None where there is no such strength.
    without : dict
        What the scene without it changes.
    """

    name: str
    asked: Json
    zero: Json | None = None
    without: Json = field(default_factory=dict)


EFFECTS = (
    Effect("ambient light", {"ambient": [1, 1, 1]}, {"ambient": [0, 0, 0]}),
    Effect("directional light", {"lights": [SUN, SUN | GREY]}, {"lights": [SUN, SUN | BLACK]}),
    Effect("point light", {"lights": [SUN, BULB | GREY]}, {"lights": [SUN, BULB | BLACK]}),
    Effect("rectangle light, 16 points", {"lights": [SUN, LAMP | GREY]}, {"lights": [SUN, LAMP | BLACK]}),
    Effect(
        "falloff of a rectangle light",
        {"lights": [LAMP | GREY | {"falloff": "physical"}]},
        without={"lights": [LAMP | GREY]},
    ),
    Effect("highlights", {"material": {"specular": 0.4, "shininess": 30}}, {"material": {"specular": 0}}),
    Effect("checker texture", {"material": {"color_texture": "board"}}),
    Effect(
        "checker texture, filtered",
        {"material": {"color_texture": "boxed"}},
        without={"material": {"color_texture": "board"}},
    ),
    Effect("image texture", {"material": {"color_texture": "picture"}}),
    Effect(
        "image texture, filtered",
        {"material": {"color_texture": "pyramid"}},
        without={"material": {"color_texture": "picture"}},
    ),
    Effect("normal map", {"material": {"normal_map": "normals"}}),
    Effect(
        "bump map",
        {"material": {"bump_map": "heights", "bump_height": 0.05}},
        {"material": {"bump_map": "heights", "bump_height": 0}},
    ),
    Effect(
        "displacement map",
        {"material": {"displacement_map": "heights", "displacement_height": 0.05}},
        {"material": {"displacement_map": "heights", "displacement_height": 0}},
    ),
    Effect("mirror", {"material": {"mirror": 0.4}}, {"material": {"mirror": 0}}),
    Effect("glass", {"material": {"transmission": 0.8}}, {"material": {"transmission": 0}}),
    Effect("lens", {"camera": {"lens_radius": 0.1}}, {"camera": {"lens_radius": 0}}),
    Effect("4 camera samples", {"samples": 4}),
    Effect("layer of depths", {"layers": ["depth"]}),
    Effect("layer of errors", {"layers": ["error"]}),
)
"""Base scene: a floor and a ball of one plain matt material under one sun, one camera sample a pixel."""


class EffectCost(TypedDict):
    """CPU seconds without the effect and with it, and what it adds to the counters of the report.

    `zero_` stands for the scene that names the effect with strength zero: the ratio of its CPU seconds to
    those without, what it adds to the counters, and whether it has the same plan and the same picture. None
    where there is no such scene.
    """

    effect: str
    without: Spread
    asked: Spread
    ratio: float
    adds: dict[str, int]
    zero_ratio: float | None
    zero_adds: dict[str, int] | None
    zero_same: bool | None


def measure(runs: int) -> list[EffectCost]:
    """Render the scenes of every effect `runs` times in turns, after one round that warms caches up."""
    return [_cost(effect, runs) for effect in EFFECTS]


def _cost(effect: Effect, runs: int) -> EffectCost:
    plans = [
        plan_of(changes) for changes in (effect.without, effect.asked, effect.zero) if changes is not None
    ]
    results = [renderer.render(plan) for plan in plans]
    rounds = [[render_seconds(plan) for plan in plans] for _ in range(runs)]
    without, asked, *zero = (spread(seconds) for seconds in zip(*rounds, strict=True))
    counts = [_counts(result) for result in results]
    same = [
        (plan.entries, result.image.tobytes()) == (plans[0].entries, results[0].image.tobytes())
        for plan, result in zip(plans, results, strict=True)
    ]
    return EffectCost(
        effect=effect.name,
        without=without,
        asked=asked,
        ratio=_ratio(asked, without),
        adds=_added(counts[0], counts[1]),
        zero_ratio=_ratio(zero[0], without) if zero else None,
        zero_adds=_added(counts[0], counts[2]) if zero else None,
        zero_same=same[2] if zero else None,
    )


def plan_of(changes: Json) -> renderer.RenderPlan:
    """Compile the base scene with some changes."""
    assets = FolderAssets(SCENES.parent / "gallery")
    return renderer.compile_scene(
        renderer.load_scene(_scene(changes), assets=assets), layers=changes.get("layers", ())
    )


def _scene(changes: Json) -> Json:
    camera = {
        "position": [0, 2, 6],
        "look_at": [0, 0.8, 0],
        "vertical_fov": 40,
        "width": SIDE,
        "height": SIDE,
    }
    floor = {"type": "rectangle", "corner": [-4, 0, -4], "edges": [[0, 0, 8], [8, 0, 0]], "material": "plain"}
    ball = {"type": "ellipsoid", "center": [0, 1, 0], "radius": 1, "material": "plain"}
    material = changes.get("material", {})
    color = {} if "color_texture" in material else {"color": [0.7, 0.6, 0.5]}
    return {
        "version": 1,
        "camera": camera | changes.get("camera", {}),
        "ambient": changes.get("ambient", [0, 0, 0]),
        "textures": TEXTURES,
        "materials": {"plain": {"type": "phong", "ambient": 0.2, "diffuse": 0.8} | color | material},
        "shapes": [floor, ball],
        "lights": changes.get("lights", [SUN]),
        "sampling": {
            "antialiasing": {"pattern": "uniform", "samples": changes.get("samples", 1)},
            "light": {"pattern": "uniform", "samples": 16},
        },
    }


def _counts(result: renderer.RenderResult) -> Counter[str]:
    return Counter(result.report["rays"] | result.report["work"])


def _added(before: Counter[str], after: Counter[str]) -> dict[str, int]:
    """Differences of counters that are not 0."""
    return {name: after[name] - before[name] for name in before | after if after[name] != before[name]}


def _ratio(some: Spread, others: Spread) -> float:
    """By the fastest runs: nothing makes a picture faster than it is."""
    return round(some["least"] / others["least"], 2)
