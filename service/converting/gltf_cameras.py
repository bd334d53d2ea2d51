"""Cameras of glTF scenes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from renderer.math.arrays import Floats
from service.converting.gltf_buffers import pick
from service.converting.gltf_document import Document
from service.converting.gltf_nodes import PlacedNode
from service.converting.task import Task

HEIGHT = 512
WIDEST = 8192
"""Pixels: more than any screen, and less than the 16 million pixels that a scene may have with HEIGHT."""


def camera_of(
    task: Task, document: Document, nodes: Sequence[PlacedNode], middle: Floats
) -> dict[str, Any] | None:
    """The first camera with a perspective view; None where there is none.

    Parameters
    ----------
    middle
        Of what is seen: as far away is the point that the camera is said to look at.

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
            task.notes.leave_out(pointer, "A camera without a perspective is left out.")
        elif chosen is None:
            chosen = _camera(placed, view.yfov, view.aspect_ratio or 1.0, middle)
            task.notes.assume(pointer, f"The picture is {chosen['width']} x {HEIGHT} pixels.")
        else:
            task.notes.leave_out(pointer, "Only the first camera is taken.")
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
        "width": max(1, min(WIDEST, round(HEIGHT * aspect))),
        "height": HEIGHT,
    }
