"""CPU seconds of two rooms, and what each effect costs."""

from __future__ import annotations

import json

import renderer
from benchmarks.everyday_shapes import bulb, sheet, sun
from benchmarks.report import SCENES, Json, keep, median_seconds, parser, show, uniform
from renderer.assets import FolderAssets

ROOMS = ("soft", 1), ("soft", 16), ("chess", 16)
"""Scenes and their camera samples a pixel."""
SUN = sun([-0.3, -1, -0.4], [0.7, 0.7, 0.7])
BULB = bulb([2, 4, 2], [0.3, 0.3, 0.3])
LAMP = {
    "type": "rectangle", "corner": [-2, 4, 0], "edges": [[1, 0, 0], [0, 0, 1]], "visible": False,
    "color": [0.3, 0.3, 0.3],
}  # fmt: skip
TEXTURES: Json = {
    "board": {"type": "checker", "repeat": [40, 40]},
    "boxed": {"type": "checker", "repeat": [40, 40], "filter": "box"},
    "picture": {"type": "image", "asset": "textures/tiles.png"},
    "pyramid": {"type": "image", "asset": "textures/tiles.png", "filter": "mipmap"},
    "normals": {"type": "image", "asset": "textures/tiles_normal.png", "encoding": "linear"},
    "heights": {"type": "image", "asset": "textures/tiles_height.png", "encoding": "linear"},
}
EFFECTS: dict[str, tuple[Json, Json]] = {
    "point light": ({}, {"lights": [SUN, BULB]}),
    "rectangle light, 16 points": ({}, {"lights": [SUN, LAMP]}),
    "highlights": ({}, {"specular": 0.4, "shininess": 30}),
    "checker texture, filtered": ({"color_texture": "board"}, {"color_texture": "boxed"}),
    "image texture, filtered": ({"color_texture": "picture"}, {"color_texture": "pyramid"}),
    "normal map": ({}, {"normal_map": "normals"}),
    "bump map": ({}, {"bump_map": "heights", "bump_height": 0.05}),
    "displacement map": ({}, {"displacement_map": "heights", "displacement_height": 0.05}),
    "mirror": ({}, {"mirror": 0.4}),
    "glass": ({}, {"transmission": 0.8}),
    "lens": ({}, {"lens_radius": 0.1}),
    "4 camera samples": ({}, {"samples": 4}),
}
"""Changes to the base scene: without the effect, and with it."""


def main() -> None:
    """Print and keep both tables."""
    options = parser("rendering", __doc__)
    options.add_argument("--runs", type=int, default=5, help="timed runs; the median counts")
    runs = options.parse_args().runs
    rooms = []
    for name, samples in ROOMS:
        document = json.loads((SCENES / "study" / f"{name}.json").read_text())
        plan = renderer.compile_scene(document | {"sampling": uniform(samples, 64)})
        shadow = renderer.render(plan).report["rays"]["shadow"]
        seconds = median_seconds(plan, runs)
        scene = f"{name}: uniform {samples} x uniform 64"
        rooms.append({"scene": scene, "seconds": seconds, "shadow_rays_a_second": shadow / seconds})
    show("Rooms", ("scene", "CPU s", "shadow rays a second"), [(*each.values(),) for each in rooms])
    effects = []
    for name, (without, with_it) in EFFECTS.items():
        before, after = (median_seconds(plan_of(changes), runs) for changes in (without, with_it))
        effects.append({"effect": name, "without": before, "with": after, "ratio": after / before})
    show("Effects", ("effect", "without, CPU s", "with", "ratio"), [(*each.values(),) for each in effects])
    keep("rendering", {"rooms": rooms, "effects": effects})


def plan_of(changes: Json) -> renderer.RenderPlan:
    """Compile a floor and a ball of one matte material under one sun, with some changes."""
    camera = {"position": [0, 2, 6], "look_at": [0, 0.8, 0], "width": 384, "height": 384}
    material = {
        name: value for name, value in changes.items() if name not in ("lights", "lens_radius", "samples")
    }
    color = {} if "color_texture" in material else {"color": [0.7, 0.6, 0.5]}
    document = {
        "version": 1,
        "camera": camera | {"lens_radius": changes.get("lens_radius", 0)},
        "textures": TEXTURES,
        "materials": {"plain": {"type": "phong", "ambient": 0.2, "diffuse": 0.8} | color | material},
        "shapes": [
            sheet([-4, 0, -4], [0, 0, 8], [8, 0, 0], "plain"),
            {"type": "ellipsoid", "center": [0, 1, 0], "radius": 1, "material": "plain"},
        ],
        "lights": changes.get("lights", [SUN]),
        "sampling": uniform(changes.get("samples", 1), 16),
    }
    return renderer.compile_scene(renderer.load_scene(document, assets=FolderAssets(SCENES / "gallery")))


if __name__ == "__main__":
    main()
