"""Lights of glTF scenes: points, directions and spots of KHR_lights_punctual."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from renderer.math.arrays import Floats
from service.converting.gltf_buffers import pick
from service.converting.gltf_document import Document, PunctualLight
from service.converting.gltf_nodes import PlacedNode
from service.converting.task import Task


def lights_of(task: Task, document: Document, nodes: Sequence[PlacedNode]) -> list[dict[str, Any]]:
    """Lights for a scene.

    A white surface that faces a light of intensity I at distance d gives back I / (pi d^2) in glTF, and
    colour / d^2 in a scene: the colour is I / pi.

    Raises
    ------
    ConversionError
        A node names a light that is not there.
    """
    known = document.extensions.lights.lights if document.extensions.lights else ()
    made = []
    for placed in nodes:
        use = placed.node.extensions.lights
        if use is not None:
            pointer = f"/nodes/{placed.number}/extensions/KHR_lights_punctual/light"
            light = pick(task.notes.file, known, use.light, pointer)
            made.append(_light(task, light, use.light, placed))
    if made:
        task.notes.assume(
            "/extensions/KHR_lights_punctual",
            "The colour of a light is its intensity divided by pi. Its shadows are hard.",
        )
    return made


def _light(task: Task, light: PunctualLight, number: int, placed: PlacedNode) -> dict[str, Any]:
    color = [part * light.intensity / math.pi for part in light.color]
    if light.type == "directional":
        direction = (-placed.world_from_node[:3, 2]).tolist()
        return {"type": "directional", "direction": direction, "color": color}
    if light.type == "spot":
        task.notes.assume(
            f"/extensions/KHR_lights_punctual/lights/{number}", "A spot shines in all directions, as a point."
        )
    position = placed.position.tolist()
    return {"type": "point", "position": position, "color": color, "falloff": "physical"}


def exposure(lights: Sequence[dict[str, Any]], middle: Floats, radius: float) -> float:
    """Stops by which the picture has to be darkened so that white in the middle is not beyond white.

    0 where it is not. A light nearer than the radius counts as being so far away.
    """
    brightest = 0.0
    for light in lights:
        strength = max(light["color"])
        if light["type"] == "point":
            distance = max(float(np.linalg.norm(np.array(light["position"]) - middle)), radius)
            strength /= distance * distance
        brightest += strength
    # Two decimals are finer than anybody sees; rounding up keeps white below white.
    return -math.ceil(100 * math.log2(brightest)) / 100 if brightest > 1 else 0.0
