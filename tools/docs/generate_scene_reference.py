"""Write docs/reference/scenes.md from the schemas."""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING

from schemas.base import Closed, fields_of
from schemas.cameras import Camera
from schemas.json_schema import scene_json_schema
from schemas.lights import DirectionalLight, ParallelogramLight, PointLight, RectangleLight
from schemas.materials import PhongMaterial
from schemas.quality import Antialiasing, LightSampling, Sampling
from schemas.scene import Display, Scene
from schemas.shapes import Ellipsoid, Mesh, MeshFile, Parallelogram, Rectangle, Sphere, Triangle, Turn
from schemas.textures import CheckerTexture, ImageTexture
from tools.docs.field_tables import table_of_fields

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]

PAGE = ROOT / "docs" / "reference" / "scenes.md"

SCENES = ROOT / "scenes" / "gallery"

_GALLERY_ROW = re.compile(r"\| \[(\w+)\.json\]\([^)]*\) \| (.*) \|")
_VECTOR = re.compile(r"\[([^\[\]{}]*)\]")

INTRODUCTION = """\
# Scenes

<!-- Written by tools/docs/generate_scene_reference.py from the schemas.
     Change those, then run python -m tools.docs.write_pages. -->

A scene is one JSON object. Lengths are in scene units, angles in degrees, and colours are linear RGB. The
world is right-handed, usually with y up. Coordinates are at most 1e15, sizes at least 1e-100. Numbers are
JSON numbers, not text, NaN or Infinity; a whole number may be written `32` or `32.0`. Unknown and repeated
fields are refused.

`penumbra validate SCENE` reports every problem at once, each with its JSON Pointer, line and column. The
machine-readable schema is at `GET /v1/schemas/scene.json`. Scenes to start from are in
[the cookbook](../how-to/cookbook.md).
"""

CLOSING = """\
## Warnings

A valid scene whose picture is probably not what you meant is rendered with a warning:

- no light shines, with ambient light (`no_light`) or without (`black_picture`);
- no shape is in view (`nothing_in_view`): the sphere around each lies outside the cone around the picture;
- a light is inside an ellipsoid (`light_inside`);
- no shape uses a material, or no material uses a texture (`unused`);
- a triangle has no area and is left out, or no triangle of a mesh in the scene has any (`no_area`);
- a triangle or mesh has a material with a texture, and no texture coordinates (`no_texture_coordinates`);
- the view is so narrow that rounding moves rays by a hundredth of a pixel or more (`narrow_view`);
- a channel of a material's colour is more than 1, as if on a scale of 0 to 255 (`bright_color`);
- `up` is parallel to the view (`up_parallel_to_view`);
- the longest axis of an ellipsoid is more than 1e8 times as long as the shortest (`very_flat`);
- a shape reaches so far that rounding moves points on it by a hundredth of a pixel or more (`very_large`);
  meshes in files are not checked.
"""

SECTIONS: dict[str, list[tuple[str, type[Closed]]]] = {
    "The scene": [("", Scene)],
    "Camera": [("", Camera)],
    "Shapes": [
        ("Triangle", Triangle),
        ("Rectangle by its centre", Rectangle),
        ("Rectangle by a corner", Parallelogram),
        ("Ellipsoid", Ellipsoid),
        ("Sphere", Sphere),
        ("Mesh", Mesh),
        ("Mesh in a file", MeshFile),
        ("Rotation of a mesh", Turn),
    ],
    "Materials": [("Phong", PhongMaterial)],
    "Textures": [("Image", ImageTexture), ("Checker", CheckerTexture)],
    "Lights": [
        ("Rectangle by its centre", RectangleLight),
        ("Rectangle by a corner", ParallelogramLight),
        ("Point", PointLight),
        ("Directional", DirectionalLight),
    ],
    "Sampling": [("", Sampling), ("Antialiasing", Antialiasing), ("Light", LightSampling)],
    "Display": [("", Display)],
}


def page() -> str:
    """Put the whole page together."""
    example = _VECTOR.sub(in_one_line, json.dumps(scene_json_schema()["examples"][0], indent=2))
    parts = [INTRODUCTION, f"```json\n{example}\n```\n"]
    for title, models in SECTIONS.items():
        parts.append(f"## {title}\n")
        for heading, model in models:
            if heading:
                parts.append(f"### {heading}\n")
            parts += [f"{inspect.getdoc(model)}\n", fields(model)]
    return "\n".join([*parts, CLOSING, *pictures()])


def pictures() -> Iterator[str]:
    """Show the gallery: a picture of each effect, with what to notice."""
    yield "## What the effects look like\n"
    yield "`make gallery` renders these pictures from the scenes in `scenes/gallery`.\n"
    for name, notice in _GALLERY_ROW.findall((SCENES / "README.md").read_text(encoding="utf-8")):
        yield f"### {name}\n\n![{name}](../images/gallery/{name}.png)\n\n{notice}\n"


def in_one_line(vector: re.Match[str]) -> str:
    """Write an array of numbers in one line."""
    return f"[{' '.join(vector[1].split())}]"


def fields(model: type[Closed]) -> str:
    """Describe the fields of a model, one per row."""
    schema = scene_json_schema()
    described = schema if model is Scene else schema["$defs"][model.__name__]
    return table_of_fields(described, fields_of(model), kind) + "\n"


def kind(name: str) -> str:
    """The `type` that chooses a definition among others."""
    definition = scene_json_schema()["$defs"][name]
    return f"`{definition['properties']['type']['const']}`"
