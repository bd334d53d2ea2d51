"""Tangents: from texture coordinates, or any that fit a normal."""

import numpy as np

from renderer.math.arrays import Floats, Masks, dot, lengths, unit

MIN_TANGENT_LENGTH = 1e-6
"""Tangents of a smaller relative length are mostly rounding."""


def frame_of_normals(normals: Floats) -> Floats:
    """A unit tangent for each unit normal, (3, N) -> (3, N), without a singular direction.

    Duff et al. 2017, "Building an orthonormal basis, revisited": the sign keeps 1 / (sign + z) bounded.
    Orthonormal to 4 eps.
    """
    x, y, z = normals
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    return np.stack((1.0 + sign * x * x * a, sign * (x * y * a), -sign * x))


def frame_of_texture(vertices: Floats, texture: Floats, normals: Floats) -> tuple[Floats, Floats, Masks]:
    """Unit tangents in which the first texture coordinate grows, their handedness, and where there is one.

    Parameters
    ----------
    vertices : (3, 3, N) float64
        Vertex, coordinate, point.
    texture : (3, 2, N) float64
    normals : (3, N) float64

    Returns
    -------
    (3, N) float64, (N,) float64, (N,) bool
        The second is -1 where vertices that are counter-clockwise seen from outside are clockwise in the
        texture: there the other texture coordinate grows along tangent x normal (glTF 2.0, MikkTSpace). A
        triangle without area in the texture, or whose tangent is all but parallel to the normal, has none.
    """
    first, second, du, dv, turn = _edges(vertices, texture)
    handedness = np.where(turn < 0, -1.0, 1.0)
    along = unit((first * dv[1] - second * du[1]) * handedness)
    rest = along - normals * dot(along, normals)
    return unit(rest), handedness, (turn != 0) & (lengths(rest) > MIN_TANGENT_LENGTH)


def derivatives_of_texture(vertices: Floats, texture: Floats) -> tuple[Floats, Floats]:
    """Derivatives (3, N) of the position by the two texture coordinates, zero where these span no area.

    Parameters
    ----------
    vertices : (3, 3, N) float64
        Vertex, coordinate, point.
    texture : (3, 2, N) float64
    """
    first, second, du, dv, turn = _edges(vertices, texture)
    share = np.where(turn != 0, 1 / np.where(turn != 0, turn, 1.0), 0.0)
    return (first * dv[1] - second * du[1]) * share, (second * du[0] - first * dv[0]) * share


def _edges(vertices: Floats, texture: Floats) -> tuple[Floats, ...]:
    """Two edges in space, the same in the texture, and twice the signed area that they span there."""
    first, second = vertices[1] - vertices[0], vertices[2] - vertices[0]
    du, dv = texture[1] - texture[0], texture[2] - texture[0]
    return first, second, du, dv, du[0] * dv[1] - du[1] * dv[0]
