"""Faces of any number of corners as triangles.

A face is cut into the fan from its first corner if that is valid; others, such as most concave ones, are cut
by ear clipping. All is decided in the coordinate plane that the face is most nearly parallel to: leaving out
a coordinate rounds nothing.
"""

from typing import TYPE_CHECKING

import numpy as np

from renderer.assets import AssetError
from renderer.math.arrays import Floats, Integers

if TYPE_CHECKING:
    from numpy.typing import NDArray

DEFAULT_COORDINATES = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
"""Default texture coordinates of a triangle's vertices."""
MOST_CORNERS = 10_000
"""Most corners of a face that is clipped: the time grows like their square, to a tenth of a second here."""
_ACROSS = np.array([[1, 2], [2, 0], [0, 1]])
"""The other two axes for each axis, in right-handed order."""


def triangulate(points: Floats, sizes: Integers) -> tuple[Integers, Integers]:
    """Triangles of some faces, with the orientation of their face.

    Parameters
    ----------
    points
        Positions of all corners, face after face, (C, 3).
    sizes
        Corners of each face, (F,), whose sum is C. A face of fewer than three gives no triangle.

    Returns
    -------
    triangles : ndarray of int64, shape (T, 3)
        Indices, among the C corners, of those of each triangle, in the order of the faces.
    faces : ndarray of int64, shape (T,)
        The face of each triangle.

    Raises
    ------
    AssetError
        A face is concave and has more than `MOST_CORNERS`, or the package that cuts it is not installed.
    """
    fans, faces = _fans(sizes)
    if (sizes <= 3).all():
        return fans, faces
    corners = points[fans]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # The area of a face is that of its fan, whose triangles count negative if their orientation is opposite.
    normals = np.stack([np.bincount(faces, weights, len(sizes)) for weights in areas.T], axis=1)
    axes = np.abs(normals).argmax(axis=1)
    ways = np.sign(normals[np.arange(len(sizes)), axes])
    against = areas[np.arange(len(fans)), axes[faces]] * ways[faces] <= 0
    odd = np.unique(faces[against])
    # A face without area has no inside, and is left as it is.
    odd = odd[(sizes[odd] > 3) & (ways[odd] != 0)]
    if (sizes[odd] > MOST_CORNERS).any():
        raise AssetError(
            f"A concave face of the mesh has {sizes[odd].max()} corners; at most {MOST_CORNERS} are allowed. "
            "Divide it."
        )
    starts = np.cumsum(sizes) - sizes
    clipped = [
        starts[face]
        + _clipped(points[starts[face] : starts[face] + sizes[face]], int(axes[face]), bool(ways[face] < 0))
        for face in odd
    ]
    return _replaced(fans, faces, odd, clipped)


def _fans(sizes: Integers) -> tuple[Integers, Integers]:
    """The fan of each face from its first corner."""
    counts = np.maximum(sizes - 2, 0)
    faces = np.repeat(np.arange(len(sizes)), counts)
    first = (np.cumsum(sizes) - sizes)[faces]
    steps = np.arange(len(faces)) - (np.cumsum(counts) - counts)[faces]
    return np.stack((first, first + steps + 1, first + steps + 2), axis=1), faces


def _replaced(
    fans: Integers, faces: Integers, odd: Integers, clipped: list[Integers]
) -> tuple[Integers, Integers]:
    """Replace the triangles of some faces."""
    kept = ~np.isin(faces, odd)
    triangles = np.concatenate([fans[kept], *clipped])
    named = np.concatenate([faces[kept], np.repeat(odd, [len(some) for some in clipped])])
    order = np.argsort(named, kind="stable")
    return triangles[order], named[order]


def _clipped(points: Floats, axis: int, turned: bool) -> Integers:
    """Triangles (T, 3) of one face, cut as seen along an axis, from behind if it is turned."""
    try:
        # Meshes without such faces are rendered where it is not installed.
        import mapbox_earcut  # noqa: PLC0415
    except ImportError as error:
        raise AssetError(
            "Meshes with concave faces need the package mapbox-earcut. Install it with: "
            "pip install 'penumbra-render[mesh]'"
        ) from error
    plane = points[:, _ACROSS[axis][::-1] if turned else _ACROSS[axis]]
    ends = np.array([len(points)], dtype=np.uint32)
    found: NDArray[np.uint32] = mapbox_earcut.triangulate_float64(np.ascontiguousarray(plane), ends)
    return found.astype(np.int64).reshape(-1, 3)
