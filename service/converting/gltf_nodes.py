"""Nodes of a glTF scene in world coordinates, with their cameras and lights."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from renderer.math.arrays import Floats
from renderer.meshes.gltf_geometry import local_matrix
from service.converting.errors import wrong_at
from service.converting.gltf_document import Cone, Document, Node, PunctualLight, pick
from service.converting.task import Task


@dataclass(frozen=True, slots=True, eq=False)
class PlacedNode:
    """A node.

    Attributes
    ----------
    number
        Its place in the document.
    node
        What it says.
    world_from_node
        (4, 4): takes columns (x, y, z, 1) from the node to the world.
    """

    number: int
    node: Node
    world_from_node: Floats

    @property
    def position(self) -> Floats:
        """Origin, (3,)."""
        return self.world_from_node[:3, 3]


def placed_nodes(name: str, document: Document) -> list[PlacedNode]:
    """All nodes of the scene that is shown, parents before their children.

    Raises
    ------
    ConversionError
        A node has two parents, is its own, or is not there.
    """
    seen: set[int] = set()
    found: list[PlacedNode] = []
    waiting = [(number, np.eye(4), pointer) for number, pointer in _roots(name, document)]
    while waiting:
        number, world_from_parent, pointer = waiting.pop(0)
        node = pick(name, document.nodes, number, pointer)
        if number in seen:
            raise wrong_at(name, pointer, f"The node {number} is in two places. Give each a node of its own.")
        seen.add(number)
        placed = PlacedNode(number, node, world_from_parent @ _local(node))
        found.append(placed)
        waiting += [
            (child, placed.world_from_node, f"/nodes/{number}/children/{place}")
            for place, child in enumerate(node.children)
        ]
    return found


def _roots(name: str, document: Document) -> Iterator[tuple[int, str]]:
    if document.scenes:
        number = document.scene or 0
        scene = pick(name, document.scenes, number, "/scene")
        yield from ((node, f"/scenes/{number}/nodes/{place}") for place, node in enumerate(scene.nodes))
        return
    children = {child for node in document.nodes for child in node.children}
    yield from ((number, "/nodes") for number in range(len(document.nodes)) if number not in children)


def _local(node: Node) -> Floats:
    return local_matrix(node.matrix, node.translation, node.rotation, node.scale)


PICTURE_HEIGHT = 512
MAX_WIDTH = 8192
"""Pixels: wider than any screen; with PICTURE_HEIGHT, fewer pixels than the 16 million of a scene."""
MIN_SPOT_ANGLE = 1e-3
"""Degrees: the smallest angle of a spot light that the scene language has."""


def camera_of(
    task: Task, document: Document, nodes: Sequence[PlacedNode], middle: Floats
) -> dict[str, Any] | None:
    """The first perspective camera; None if there is none.

    Parameters
    ----------
    middle
        Of the visible scene: the camera's `look_at` is at this distance.

    Raises
    ------
    ConversionError
        A node names a camera that is not there.
    """
    chosen: dict[str, Any] | None = None
    for placed in nodes:
        if placed.node.camera is None:
            continue
        pointer = f"/nodes/{placed.number}/camera"
        view = pick(task.notes.file, document.cameras, placed.node.camera, pointer).perspective
        if view is None:
            task.notes.leave_out(pointer, "Orthographic cameras are left out.")
        elif chosen is None:
            chosen = _camera(placed, view.yfov, view.aspect_ratio or 1.0, middle)
            task.notes.assume(pointer, f"The picture is {chosen['width']} x {PICTURE_HEIGHT} pixels.")
        else:
            task.notes.leave_out(pointer, "Only the first camera is used.")
    return chosen


def _camera(placed: PlacedNode, yfov: float, aspect: float, middle: Floats) -> dict[str, Any]:
    axes = placed.world_from_node[:3, :3]
    forward = -axes[:, 2] / (np.linalg.norm(axes[:, 2]) or 1.0)
    ahead = float((middle - placed.position) @ forward)
    return {
        "position": placed.position.tolist(),
        "look_at": (placed.position + (ahead if ahead > 0 else 1.0) * forward).tolist(),
        "up": axes[:, 1].tolist(),
        "vertical_fov": math.degrees(yfov),
        "width": max(1, min(MAX_WIDTH, round(PICTURE_HEIGHT * aspect))),
        "height": PICTURE_HEIGHT,
    }


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
    direction = (-placed.world_from_node[:3, 2]).tolist()
    if light.type == "directional":
        return {"type": "directional", "direction": direction, "color": color}
    made = {"type": light.type, "position": placed.position.tolist(), "color": color, "falloff": "physical"}
    if light.type == "point":
        return made
    return {**made, "direction": direction, **_angles(task, light.spot, number)}


def _angles(task: Task, cone: Cone, number: int) -> dict[str, float]:
    """The angles of a spot light, degrees."""
    inner, outer = (math.degrees(angle) for angle in (cone.inner_cone_angle, cone.outer_cone_angle))
    outer = min(max(outer, MIN_SPOT_ANGLE), 90.0)
    if inner >= outer:
        pointer = f"/extensions/KHR_lights_punctual/lights/{number}/spot"
        task.notes.assume(pointer, "The edge of the cone is a hundredth of its angle wide.")
        inner = 0.99 * outer
    return {"inner_angle": inner, "outer_angle": outer}


def exposure(lights: Sequence[dict[str, Any]], middle: Floats, radius: float) -> float:
    """Stops by which the picture has to be darkened so that white in the middle is not beyond white.

    0 where it is not. A light nearer than the radius counts as being so far away.
    """
    brightest = 0.0
    for light in lights:
        strength = max(light["color"])
        if "position" in light:
            distance = max(float(np.linalg.norm(np.array(light["position"]) - middle)), radius)
            strength /= distance * distance
        brightest += strength
    # Two decimals are finer than the eye; rounding up keeps white below white.
    return -math.ceil(100 * math.log2(brightest)) / 100 if brightest > 1 else 0.0
