"""Cameras with axes of other lengths or angles, and screens whose sides or pixels are counted wrongly."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from functools import partial

import numpy as np

from renderer.cameras import Pinhole, build_pinhole, upward
from renderer.interaction import Rays
from renderer.math.arrays import Floats, cross, dot, unit
from renderer.plan.plan import RenderPlan
from schemas.cameras import Camera
from schemas.scene import Scene

Change = Callable[[RenderPlan], RenderPlan]
"""Makes a mistake in the plan of a scene."""

Refit = Callable[[Pinhole], Pinhole]

BORDER, CENTRE = 0.0, 0.5
"""Origins of programs that divide by width - 1: the border of the first pixel, or its centre."""


@dataclass(frozen=True, slots=True, eq=False)
class MiscountedPixels(Pinhole):
    """A camera that divides by one pixel too few.

    Attributes
    ----------
    columns, rows : int
        Pixels of the whole picture; `width` and `height` may be those of a smaller trial.
    first : float
        The position, in pixels of the whole picture, that is taken for the left and upper border.
    """

    columns: int
    rows: int
    first: float

    def screen(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Place on the screen at distance 1 of raster positions."""
        across = (x * (self.columns / self.width) - self.first) / (self.columns - 1)
        down = (y * (self.rows / self.height) - self.first) / (self.rows - 1)
        return self.half_width * (2 * across - 1), self.half_height * (1 - 2 * down)


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
        for first in (BORDER, CENTRE):
            yield "size_minus_one", partial(_miscounted, camera, first)


def _miscounted(camera: Camera, first: float, right: Pinhole) -> Pinhole:
    kept = {field.name: getattr(right, field.name) for field in fields(Pinhole)}
    return MiscountedPixels(**kept, columns=camera.width, rows=camera.height, first=first)


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
