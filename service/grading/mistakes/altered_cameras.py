"""Cameras with axes of other lengths or angles, or wrong screens."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from renderer.cameras import Pinhole, build_pinhole, upward
from renderer.interaction import Rays
from renderer.math.arrays import cross, dot, unit
from renderer.plan.plan import RenderPlan
from schemas.cameras import Camera
from schemas.scene import Scene
from service.grading.displacements import STRETCHED, DisplacedPinhole

Change = Callable[[RenderPlan], RenderPlan]
"""Makes a mistake in the plan of a scene."""

Refit = Callable[[Pinhole], Pinhole]


@dataclass(frozen=True, slots=True)
class Unbounded:
    """Stage: rays of which nothing is known beforehand, so that every shape is tried.

    Bounds of shapes on the screen are those of the right camera.
    """

    def run(self, rays: Rays) -> None:
        """Forget the bounds."""
        rays.screen = None


def altered_cameras(document: Scene) -> Iterator[tuple[str, Change]]:
    """Causes, and the changes of plans that make these mistakes."""
    camera = document.camera
    for cause, refit in (*_screens(camera), *_axes(camera)):
        yield cause, partial(_with_camera, refit)


def _with_camera(refit: Refit, plan: RenderPlan) -> RenderPlan:
    return replace(plan, camera=refit(plan.camera), intersectors=(Unbounded(), *plan.intersectors))


def _screens(camera: Camera) -> Iterator[tuple[str, Refit]]:
    if camera.width != camera.height:
        yield "aspect_ignored", lambda right: replace(right, half_width=right.half_height)
    if min(camera.width, camera.height) > 1 and not camera.lens_radius:
        for wrong in STRETCHED:
            yield wrong.cause, partial(DisplacedPinhole.of, wrong, camera.width, camera.height)


def _axes(camera: Camera) -> Iterator[tuple[str, Refit]]:
    forward, up = build_pinhole(camera).forward, upward(camera)
    length = float(np.sqrt(np.sum(cross(forward, up) ** 2)))
    if not np.isclose(length, 1):
        yield "camera_axes_not_unit", partial(_scaled, length, length)
        yield "camera_axes_not_unit", partial(_scaled, length, 1.0)
    if not np.isclose(dot(forward, unit(up)).item(), 0):
        yield "camera_axes_not_orthogonal", lambda right: replace(right, up=unit(up))


def _scaled(across: float, upwards: float, right: Pinhole) -> Pinhole:
    return replace(right, right=across * right.right, up=upwards * right.up)
