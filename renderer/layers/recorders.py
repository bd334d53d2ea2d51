"""The layers: for each one small function of the points where rays met shapes, and one line of the table."""

import numpy as np

from renderer.interaction import MISS, Points
from renderer.layers import spread
from renderer.layers.layer import Layer, Statistic
from renderer.math.arrays import Floats, Integers, lengths

REAL, WHOLE = np.dtype(np.float32), np.dtype(np.int32)
XYZ, RGB, UV, ID = ("X", "Y", "Z"), ("R", "G", "B"), ("U", "V"), ("id",)


def depth(points: Points) -> Floats:
    """Distance from the camera, (M,) scene units."""
    return points.t * lengths(points.directions)


def position(points: Points) -> Floats:
    """Places in the world, (3, M) scene units."""
    return points.positions


def normal(points: Points) -> Floats:
    """Geometric unit normals on the camera's side, (3, M)."""
    return points.normals


def shading_normal(points: Points) -> Floats:
    """Unit normals as light meets them, (3, M)."""
    return points.shading_normals


def albedo(points: Points) -> Floats:
    """Colours of the surface, linear (3, M): the factor that ambient and diffuse light have in common."""
    return points.colors


def uv(points: Points) -> Floats:
    """Texture coordinates, (2, M)."""
    return points.coordinates


def shape(points: Points) -> Integers:
    """Indices into the scene's shapes, (M,)."""
    return points.shapes


def primitive(points: Points) -> Integers:
    """Numbers of triangles within a mesh, else 0, (M,)."""
    return points.primitives


ERROR = Statistic(spread.Spread, spread.merged, spread.standard_errors)


def _table(*layers: Layer) -> dict[str, Layer]:
    return {layer.name: layer for layer in layers}


LAYERS: dict[str, Layer] = _table(
    Layer("depth", "distances from the camera", ("Z",), REAL, np.inf, depth),
    Layer("position", "places in the world", XYZ, REAL, np.nan, position),
    Layer("normal", "geometric normals on the camera's side", XYZ, REAL, np.nan, normal),
    Layer("shading_normal", "normals as light meets them", XYZ, REAL, np.nan, shading_normal),
    Layer("albedo", "colours of surfaces", RGB, REAL, 0.0, albedo),
    Layer("uv", "texture coordinates", UV, REAL, np.nan, uv),
    Layer("shape", "indices into the scene's shapes", ID, WHOLE, MISS, shape),
    Layer("primitive", "triangles within meshes", ID, WHOLE, 0, primitive),
    Layer("samples", "camera samples of each pixel", ("count",), WHOLE, 0),
    Layer("error", "estimated standard errors of the pixels", RGB, REAL, np.inf, statistic=ERROR),
)
"""Every layer by its name. The ground of `samples` is filled in when a plan is made."""
