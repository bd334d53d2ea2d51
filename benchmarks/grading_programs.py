"""Programs that solve the ready assignment, right or with one mistake each, and the files that they hand in.

They render with this package, by random patterns and with other seeds than the references. A mistake is made
in the scene, in its texture files or in the picture.
"""

from __future__ import annotations

import io
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from PIL import Image

import renderer
from benchmarks.report import SCENES, Json
from renderer.images.colors import linear_from_srgb, srgb_from_linear
from renderer.scenes import LoadedScene
from schemas.grading.manifest_reading import read_manifest
from schemas.grading.manifests import ImageTest
from schemas.scene import Scene

if TYPE_CHECKING:
    from collections.abc import Callable

    from renderer.assets import AssetSource

    Array = np.ndarray[Any, Any]
    Change = Callable[[Json], Json]
    Alter = Callable[[Array], Array]

ASSIGNMENT = SCENES / "assignment"
MANIFEST = read_manifest((ASSIGNMENT / "manifest.yaml").read_bytes(), yaml=True)
TESTS = {Path(test.submitted.file).stem: test for test in MANIFEST.tests if isinstance(test, ImageTest)}
"""Tests of pictures, by the name of their scene."""


def unchanged(value: Any) -> Any:
    """The same document or the same values."""
    return value


class Program(NamedTuple):
    """A program: the cause that names its mistake, and what it changes in scenes, pictures and textures."""

    cause: str = ""
    scene: Change = unchanged
    linear: Alter = unchanged
    texels: Callable[[str, Array], Array] | None = None


RIGHT = Program()


class _Files(NamedTuple):
    """Texture files of a scene, changed as they are read."""

    source: AssetSource
    change: Callable[[str, Array], Array]

    def read(self, name: str) -> bytes:
        """The changed file as PNG."""
        texels = np.asarray(Image.open(io.BytesIO(self.source.read(name))).convert("RGB"))
        return _png(np.ascontiguousarray(self.change(name, texels)))


def _camera(**changes: Callable[[Any], Any]) -> Change:
    def change(document: Json) -> Json:
        camera = document["camera"]
        return document | {"camera": camera | {key: new(camera.get(key)) for key, new in changes.items()}}

    return change


def _each(part: str, change: Change) -> Change:
    """Change each light, shape, material or texture of a document."""

    def whole(document: Json) -> Json:
        kept = document.get(part, {})
        if isinstance(kept, dict):
            return document | {part: {name: change(one) for name, one in kept.items()}}
        return document | {part: [change(one) for one in kept]}

    return whole


def _without_last(part: str) -> Change:
    return lambda document: document | {part: document[part][: max(1, len(document[part]) - 1)]}


def _point(light: Json) -> Json:
    if light["type"] != "rectangle":
        return light
    center = np.array(light["corner"]) + np.sum(light["edges"], axis=0) / 2
    return {"type": "point", "position": center.tolist(), "color": light["color"]}


def _moved(light: Json) -> Json:
    if light["type"] != "rectangle":
        return light
    return light | {"corner": (np.array(light["corner"]) + np.sum(light["edges"], axis=0) / 2).tolist()}


def _doubled(shape: Json) -> Json:
    if shape["type"] != "triangle":
        return shape
    a, b, c = np.array(shape["vertices"], dtype=float)
    edges = [(b - a).tolist(), (c - a).tolist()]
    return {"type": "rectangle", "corner": a.tolist(), "edges": edges, "material": shape["material"]}


def _not_decoded(texture: Json) -> Json:
    return texture | {"encoding": "linear"} if texture.get("encoding") == "srgb" else texture


def _of_maps(change: Alter) -> Callable[[str, Array], Array]:
    return lambda name, texels: change(texels) if "normal" in name else texels


def _decoded(texels: Array) -> Array:
    return np.rint(255 * linear_from_srgb(texels / 255)).astype(np.uint8)


def _green(texels: Array) -> Array:
    return np.dstack((texels[:, :, 0], 255 - texels[:, :, 1], texels[:, :, 2]))


def _sampled(part: str, pattern: str, samples: int) -> Change:
    return lambda document: (
        document | {"sampling": document["sampling"] | {part: {"pattern": pattern, "samples": samples}}}
    )


WRONG = {
    "no ambient term": Program("ambient_missing", lambda scene: scene | {"ambient": [0, 0, 0]}),
    "hard shadows": Program("hard_shadows", _each("lights", _point)),
    "light moved by half its size": Program("light_misplaced", _each("lights", _moved)),
    "a light missing": Program("light_missing", _without_last("lights")),
    "falloff of lights": Program(
        "falloff",
        _each("lights", lambda one: one if one["type"] == "directional" else one | {"falloff": "physical"}),
    ),
    "twice the shininess": Program(
        "shininess", _each("materials", lambda one: one | {"shininess": 2 * one.get("shininess", 1)})
    ),
    "twice the field of view": Program(
        "field_of_view", _camera(vertical_fov=lambda angle: min(2 * angle, 170))
    ),
    "up ignored": Program("up_ignored", _camera(up=lambda _: [0, 1, 0])),
    "a shape missing": Program("shape_missing", _without_last("shapes")),
    "triangles too large": Program("triangles_too_large", _each("shapes", _doubled)),
    "textures upside down": Program("texture_upside_down", texels=lambda _, texels: texels[::-1]),
    "textures mirrored": Program("texture_mirrored", texels=lambda _, texels: texels[:, ::-1]),
    "textures not decoded": Program("texture_not_decoded", _each("textures", _not_decoded)),
    "normal map decoded": Program("normal_map_decoded", texels=_of_maps(_decoded)),
    "normal map ignored": Program(
        "normal_map_missing", _each("materials", lambda one: one | {"normal_map": None})
    ),
    "green of normal maps turned": Program("normal_map_green", texels=_of_maps(_green)),
    "no anti-aliasing": Program("antialiasing_missing", _sampled("antialiasing", "center", 1)),
    "upside down": Program("flipped_vertically", linear=lambda linear: linear[::-1]),
    "mirrored": Program("flipped_horizontally", linear=lambda linear: linear[:, ::-1]),
    "blue and red swapped": Program("channels_bgr", linear=lambda linear: linear[:, :, ::-1]),
    "not encoded": Program("gamma_missing", linear=linear_from_srgb),
    "encoded twice": Program("gamma_twice", linear=srgb_from_linear),
    "half as bright again": Program("exposure", linear=lambda linear: 1.5 * linear),
    "one pixel to the right": Program("one_pixel_right", linear=lambda linear: np.roll(linear, 1, 1)),
}
"""Programs with one mistake in all their pictures."""


def picture(name: str, program: Program = RIGHT, samples: int = 16, seed: int = 0) -> Array:
    """A picture as a program makes it, 8-bit codes (H, W, 3)."""
    scene = renderer.load_scene(ASSIGNMENT / f"{name}.json")
    document = scene.document.model_dump(mode="json", exclude_unset=True)
    advanced = name == "antialiasing_advanced"
    document["sampling"] = {
        # Its test asks for the quality of 16 samples.
        "antialiasing": {"pattern": "stratified", "samples": max(16, samples)}
        if advanced
        else {"pattern": "random", "samples": samples},
        "light": {"pattern": "random", "samples": 1},
        "seed": seed + 1000,
    }
    assets = scene.assets if program.texels is None else _Files(scene.assets, program.texels)
    changed = LoadedScene(Scene.model_validate(program.scene(document)), assets)
    linear = renderer.render(renderer.compile_scene(changed)).image.astype(np.float64)
    return codes(program.linear(np.clip(linear, 0, 1)))


def codes(linear: Array) -> Array:
    """Linear values as 8-bit sRGB codes."""
    return np.rint(255 * srgb_from_linear(np.clip(linear, 0, 1))).astype(np.uint8)


def hand_in(folder: Path, program: Program = RIGHT, samples: int = 16, seed: int = 0) -> Path:
    """Write all that a program hands in."""
    folder.mkdir(parents=True)
    for name in TESTS:
        save(folder, name, picture(name, program, samples, seed))
    for name, content in hits().items():
        (folder / name).write_bytes(content)
    return folder


def save(folder: Path, name: str, image: Array) -> None:
    """Save the picture of a scene."""
    (folder / f"{name}.png").write_bytes(_png(image))


def _png(image: Array) -> bytes:
    file = io.BytesIO()
    Image.fromarray(image).save(file, "PNG", compress_level=1)
    return file.getvalue()


@cache
def hits() -> dict[str, bytes]:
    """The right hits of all tables of rays, as files by their names."""
    files = {}
    for rays in sorted(ASSIGNMENT.glob("rays_*.npz")):
        with np.load(rays) as given:
            plan = renderer.compile_scene(rays.with_suffix(".json"))
            found = renderer.trace(plan, given["origins"], given["directions"])
        file = io.BytesIO()
        np.savez(file, t=found.t, position=found.position, normal=found.normal, shape=found.shape)
        files[rays.name] = file.getvalue()
    return files
