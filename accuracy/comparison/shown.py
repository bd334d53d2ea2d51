"""The shape that each pixel of a scene shows, to name regions of a picture."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.compiling import compile_scene
from renderer.integrator import render_layers
from renderer.scenes import LoadedScene
from schemas.quality import Antialiasing, FixedQuality, LightSampling
from schemas.scene import Scene
from schemas.tiles import Tile

CHEAPEST = FixedQuality(
    mode="fixed",
    antialiasing=Antialiasing(pattern="center", samples=1),
    light=LightSampling(pattern="uniform", samples=1),
)
"""Shapes need no light: the scene's own quality would only take time to compile."""


def shapes_shown(scene: LoadedScene) -> NDArray[Any]:
    """Index of the shape at the centre of each pixel, (H, W) int32; -1 for none.

    Raises
    ------
    SceneError
        If the scene, or a file that it names, cannot be used.
    """
    plan = compile_scene(scene, CHEAPEST, layers=("shape",))
    layers, _ = render_layers(plan, Tile(0, 0, 0, plan.width, plan.height))
    return np.asarray(layers["shape"])


def names_of(scene: Scene) -> list[str]:
    """Names of a scene's shapes, by index: name or type, and pointer."""
    return [f"{shape.name or shape.type} (shapes/{number})" for number, shape in enumerate(scene.shapes)]
