"""Which pixels lie on an edge, where a rounding may decide what they show."""

import numpy as np

import renderer
from renderer.integrator import intersect, workspace
from renderer.interaction import Points, Rays
from renderer.math.arrays import Floats, Masks
from renderer.plan.building import compile_visibility
from renderer.plan.stages import Lighting
from renderer.waves import camera_wave

NOTHING = -2.0
"""Stands for what a ray would meet that was not sent."""


def on_edges(plan: renderer.RenderPlan) -> Masks:
    """Pixels (H, W) whose own rays do not all see the same.

    Nine rays go through each pixel: through its corners, the middles of its sides, and its centre. They see
    the same if all of them, and all rays that mirrors and glass send on from them, meet the same triangle or
    other shape, and see the same share of every light from there.
    """
    size = plan.width * plan.height
    pixels = np.arange(size).repeat(9)
    down, across = np.divmod(np.tile(np.arange(9), size), 3)
    samples = np.zeros_like(pixels)
    x, y = pixels % plan.width + across / 2, pixels // plan.width + down / 2
    origins, directions = plan.camera.rays(x, y, pixels, samples)
    lights = compile_visibility(plan)
    differ = np.zeros(size, dtype=bool)
    waiting = [camera_wave(Rays(origins, directions, pixels, samples))]
    while waiting:
        wave = waiting.pop()
        points = intersect(plan, wave.rays)
        seen = [wave.rays.shapes, wave.rays.primitives]
        for light in lights:
            shares = np.full(wave.rays.t.size, NOTHING)
            shares[points.rays] = _shares(light, points)
            seen.append(shares)
        for row in seen:
            of_all = np.full(9 * size, NOTHING)
            of_all[wave.targets] = row
            nine = of_all.reshape(size, 9)
            differ |= (nine != nine[:, :1]).any(axis=1)
        for spawner in plan.spawners:
            waiting.extend(spawner.run(points, wave))
    return differ.reshape(plan.height, plan.width)


def _shares(light: Lighting, points: Points) -> Floats:
    """Share of a light's points that each point sees above its horizon, (M,)."""
    shares = np.zeros(points.count)
    view = light.view(points, workspace())
    if view.count:
        visible = view.above_horizon(view.of_points(points.normals))
        if view.blocked is not None:
            visible &= ~view.blocked
        shares[view.chosen] = visible.mean(axis=0)
    return shares
