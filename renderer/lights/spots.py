"""Spot lights: points that shine into a cone, with the smooth edge of glTF's KHR_lights_punctual.

At an angle t from the axis the light counts ((cos t - cos outer) / (cos inner - cos outer))^2, from 0 to 1.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

import schemas.lights as language
from renderer.lights.emitters import Emitter, build_point
from renderer.lights.view import LightView, Weights
from renderer.math.arrays import column, cross, dot, unit
from renderer.shapes.frames import frame_of_normals
from schemas.quality import LightSampling


def build(number: int, light: language.SpotLight, sampling: LightSampling, seed: int) -> Emitter:
    """A point light without light outside of its cone."""
    axis = unit(column(light.direction))
    across = frame_of_normals(axis)
    return replace(
        build_point(number, light, sampling, seed),
        across=across,
        along=cross(axis, across),
        normal=axis,
        least_cosine=math.cos(math.radians(light.outer_angle)),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Cone:
    """Stage of a light: the edge of its cone.

    Attributes
    ----------
    outer, width : float
        1 - cos of the outer angle, and its difference from that of the inner angle.
    """

    outer: float
    width: float

    def run(self, view: LightView) -> None:
        """Weigh the view's points.

        1 - cos t is half the squared distance of two unit vectors: no digit of a narrow cone is lost.
        """
        apart = unit(view.towards) + view.emitter.normal
        share = np.clip((self.outer - dot(apart, apart) / 2) / self.width, 0, 1)
        view.weigh(Weights(np.ones((1, view.count), view.dtype), share * share))


def cone(light: language.SpotLight) -> Cone:
    """The cone of a spot light."""
    half = math.radians(light.outer_angle) / 2
    across = math.radians(light.outer_angle - light.inner_angle) / 2
    # Differences of cosines as products of sines, in which nothing cancels.
    width = 2 * math.sin(2 * half - across) * math.sin(across)
    return Cone(2 * math.sin(half) ** 2, width)
