"""Stages of all materials: colours, ambient light, and normals from maps."""

from dataclasses import dataclass

import numpy as np

from renderer.interaction import Points
from renderer.math.arrays import Floats, Integers, Masks, cross, dot, lengths, put, taken, unit
from renderer.shapes.frames import MIN_TANGENT_LENGTH, frame_of_normals
from renderer.textures import Texture
from renderer.textures.heights import LOOKUPS_A_SLOPE, Heights

MIN_SQUARED_LENGTH = 1e-3
"""Squared length of a decoded normal below which it has no direction; mid grey, 128, decodes to 4.6e-5."""


@dataclass(frozen=True, slots=True, eq=False)
class Colors:
    """Stage: each point takes its material's colour.

    Attributes
    ----------
    colors : (3, materials) float64
    """

    colors: Floats

    def run(self, points: Points) -> None:
        """Fill in the colours."""
        points.colors[...] = taken(self.colors, points.materials)


@dataclass(frozen=True, slots=True, eq=False)
class Ambient:
    """Stage: ambient light.

    Attributes
    ----------
    strengths : (materials,) float64
    light : (3, 1) float64
    """

    strengths: Floats
    light: Floats

    def run(self, points: Points) -> None:
        """Add ambient_light * ambient * color."""
        points.radiance += self.light * self.strengths[points.materials] * points.colors


@dataclass(frozen=True, slots=True, eq=False)
class ColorTexture:
    """Stage: colours of the materials that use one texture.

    Attributes
    ----------
    texture : Texture
    used : (materials,) bool
    """

    texture: Texture
    used: Masks

    def run(self, points: Points) -> None:
        """Look up the colours of the points of these materials."""
        chosen = np.flatnonzero(self.used[points.materials])
        if chosen.size:
            coordinates = _of(points.coordinates, chosen)
            put(points.colors, chosen, self.texture.at(coordinates, points.footprints_at(chosen)))
            points.lookups += chosen.size


@dataclass(frozen=True, slots=True, eq=False)
class TangentFrames:
    """Stage: tangents and cotangents, perpendicular to the smooth normal where there is one.

    The cotangent is normal x tangent times the handedness, as of glTF 2.0 and MikkTSpace, so that a map on
    mirrored texture coordinates shows the relief that it shows elsewhere, mirrored. A smooth normal along the
    tangent takes any frame that fits it.

    Attributes
    ----------
    used : (materials,) bool
        Materials with normal maps.
    """

    used: Masks

    def run(self, points: Points) -> None:
        """Give the points of these materials their tangents."""
        points.tangents = np.zeros((6, points.count))
        chosen = np.flatnonzero(self.used[points.materials])
        side = np.where(points.flipped[chosen], -1.0, 1.0)
        outward = taken(points.shading_normals, chosen) * side
        frames = taken(points.frames, chosen)
        tangents, handedness = frames[:3], frames[3]
        rest = tangents - outward * dot(tangents, outward)
        tangents = np.where(lengths(rest) > MIN_TANGENT_LENGTH, unit(rest), frame_of_normals(outward))
        cotangents = cross(outward, tangents) * handedness
        put(points.tangents, chosen, np.vstack((tangents, cotangents)) * side)


@dataclass(frozen=True, slots=True, eq=False)
class NormalMap:
    """Stage: shading normals of the materials that use one normal map.

    Attributes
    ----------
    texture : Texture
    used : (materials,) bool
    """

    texture: Texture
    used: Masks

    def run(self, points: Points) -> None:
        """Turn texels c into normals 2 c - 1 in the frame (tangent, cotangent, outward normal)."""
        chosen = np.flatnonzero(self.used[points.materials])
        if not chosen.size:
            return
        coordinates = _of(points.coordinates, chosen)
        decoded = 2 * self.texture.at(coordinates, points.footprints_at(chosen)) - 1
        points.lookups += chosen.size
        silent = dot(decoded, decoded) < MIN_SQUARED_LENGTH
        decoded = np.where(silent, np.array([[0.0], [0.0], [1.0]]), decoded)
        tangents, cotangents = np.vsplit(_of(points.tangents, chosen), 2)
        normals = _of(points.shading_normals, chosen)
        put(
            points.shading_normals,
            chosen,
            unit(decoded[0] * tangents + decoded[1] * cotangents + decoded[2] * normals),
        )


@dataclass(frozen=True, slots=True, eq=False)
class BumpMap:
    """Stage: shading normals of the materials that use one bump map; nothing is moved.

    The normal is that of the surface moved by the heights H along its normal n, to first order:
    (p_u + H_u n) x (p_v + H_v n) (Blinn 1978).

    Attributes
    ----------
    heights : Heights
    used : (materials,) bool
    """

    heights: Heights
    used: Masks

    def run(self, points: Points) -> None:
        """Tilt the normals against the slopes of the heights."""
        chosen = np.flatnonzero(self.used[points.materials])
        if not chosen.size:
            return
        side = np.where(points.flipped[chosen], -1.0, 1.0)
        normals = _of(points.shading_normals, chosen) * side
        by_u, by_v = np.vsplit(_of(points.derivatives, chosen), 2)
        slope_u, slope_v = self.heights.slopes(_of(points.coordinates, chosen))
        points.lookups += LOOKUPS_A_SLOPE * chosen.size
        area = dot(cross(by_u, by_v), normals)
        tilt = slope_u * cross(normals, by_v) + slope_v * cross(by_u, normals)
        tilted = unit(np.abs(area) * normals + np.where(area < 0, -1.0, 1.0) * tilt)
        put(points.shading_normals, chosen, np.where(area == 0, normals, tilted) * side)


def _of(values: Floats, chosen: Integers) -> Floats:
    """Values (R, N) of some points, in order, without a copy if they are all."""
    return values if chosen.size == values.shape[1] else taken(values, chosen)


@dataclass(frozen=True, slots=True)
class Horizon:
    """Stage: bends normals to the horizon that smoothing or maps have turned away from the viewer.

    A visible point cannot face away. Its normal keeps the part across the line of sight, which continues the
    normals on this side of the horizon without a jump; flipping it would light points that face away from the
    light, and discarding the point would leave a black hole. The stage runs once, after all that tilt
    normals, so that a flat map has no effect.
    """

    def run(self, points: Points) -> None:
        """Bend the normals that need it."""
        away = np.flatnonzero(dot(points.shading_normals, points.viewers) <= 0)
        if away.size:
            points.shading_normals[:, away] = _at_horizon(points, away)


def _at_horizon(points: Points, away: Integers) -> Floats:
    """Unit normals (3, m) across the line of sight.

    A normal that points straight away, or is 0 because the normals around it cancel, has no such direction:
    the geometric normal replaces it.
    """
    normals, viewers = points.shading_normals[:, away], points.viewers[:, away]
    across = normals - viewers * dot(normals, viewers)
    return np.where(lengths(across) > MIN_TANGENT_LENGTH, unit(across), points.normals[:, away])
