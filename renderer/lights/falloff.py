"""Light that falls with the distance: `falloff: "physical"`.

A rectangle gives g = cos(theta) area / (pi d^2), so that the mean over its points is the form factor of the
light as seen from the surface (Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", C-11 and
C-12). A point light gives g = 1 / d^2, d in scene units. Without this stage g = 1.

On a plane light d cos(theta) is the same for all its points: the height of the point above the light's plane.
So g is a power of 1 / d per pair, times a factor per point.
"""

from dataclasses import dataclass

import numpy as np

from renderer.lights.view import LightView, Weights
from renderer.math.arrays import Floats
from renderer.math.numerics import PLANE_ERROR
from schemas.lights import Light


@dataclass(frozen=True, slots=True)
class Falloff:
    """Stage of a light: weights of its points by their distance.

    Attributes
    ----------
    area : bool
        Whether the light is a rectangle, so that g is the integrand of a form factor.
    """

    area: bool

    def run(self, view: LightView) -> None:
        """Weigh the view's light points.

        Pair work holds (nearest / d)^power, between 0 and 1, which overflows nowhere; what remains is a
        factor in float64, one a point. Light points that touch the point, within the rounding of both, give
        nothing.
        """
        scale = view.scale()
        touching = PLANE_ERROR * (view.of_points(view.points.sizes) + view.emitter.size) * scale
        ratios = view.pairs("falloff")
        np.copyto(ratios, view.inverse_distances())
        close = ratios >= (1 / touching).astype(ratios.dtype)
        if close.any():
            np.multiply(ratios, ~close, out=ratios)
        nearest = ratios.max(axis=0)
        np.divide(ratios, np.where(nearest > 0, nearest, 1), out=ratios)
        inverse = nearest.astype(np.float64)
        if self.area:
            np.multiply(ratios, ratios * ratios, out=ratios)
            view.weigh(Weights(ratios, self._heights(view) * inverse**3))
        else:
            np.multiply(ratios, ratios, out=ratios)
            view.weigh(Weights(ratios, (inverse * np.where(inverse > 0, scale, 0.0)) ** 2))

    def _heights(self, view: LightView) -> Floats:
        """Height above the light's plane times its area over pi, in the points' own scale."""
        frame = view.frame()
        return np.abs(frame.away) * np.abs(frame.first * frame.second_along) / np.pi


def build(light: Light) -> Falloff:
    """The falloff of a light."""
    return Falloff(area=light.type == "rectangle")
