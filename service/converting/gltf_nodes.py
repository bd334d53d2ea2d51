"""The nodes of a glTF scene with their places in the world."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from renderer.math.arrays import Floats
from service.converting.errors import wrong_at
from service.converting.gltf_buffers import pick
from service.converting.gltf_document import Document, Node


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
        """Where its origin is, (3,)."""
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
    if node.matrix is not None:
        return np.array(node.matrix).reshape(4, 4).T
    matrix = np.eye(4)
    matrix[:3, :3] = _turn(np.array(node.rotation)) * np.array(node.scale)
    matrix[:3, 3] = node.translation
    return matrix


def _turn(quaternion: Floats) -> Floats:
    """Rotation matrix of a quaternion x, y, z, w of any length but 0, which turns nothing."""
    square = float(quaternion @ quaternion)
    if square == 0:
        return np.eye(3)
    x, y, z, w = quaternion / np.sqrt(square)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
