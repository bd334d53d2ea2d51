"""Boxes inside closed meshes: a segment that passes one and ends outside the mesh crosses its surface.

Most of a solid's shadow needs no ray then. Nothing is lost where no such box is found.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.accelerators.boxes import Boxes
from renderer.math.arrays import Floats, Integers, Masks, cross, dot, lengths
from renderer.math.streams import keys
from renderer.shapes.triangles import Triangles

CELLS = 32
"""Cells along the longest side of a mesh's bounds: finer ones find more, and boxes for thin limbs."""

MOST = 8
"""Boxes a mesh, at most: each costs a test of all pairs that it may stand between."""

WORTH = 2.0**-9
"""A box smaller than this share of the mesh's bounds is not worth its tests."""

ROUNDING = 2.0**-50
"""Grain of a vertex, in shares of the largest coordinate: what forming it from a sine or two costs."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A closed mesh.

    Attributes
    ----------
    low, high : (3, 1) float64
        Bounds of the mesh.
    boxes : Boxes
        Inside, away from all triangles.
    """

    low: Floats
    high: Floats
    boxes: Boxes


def solids_of(family: Triangles) -> tuple[Solid, ...]:
    """The closed meshes of a family in which boxes were found."""
    found = []
    for number in np.unique(family.numbers):
        vertices = family.vertices[:, :, family.numbers == number]
        if is_closed(vertices):
            found.append(_solid_of(vertices))
    return tuple(solid for solid in found if solid.boxes.count)


def is_closed(vertices: Floats) -> bool:
    """Whether triangles (3, 3, T) bound a solid: each edge has a neighbour that runs the other way.

    A random function of an edge that changes its sign with the direction sums to zero then, and else but
    once in 2**64 times. Vertices within rounding of each other count as one: no hole is that small.
    """
    grain = ROUNDING * np.abs(vertices).max()
    first, second, third = (_names(np.rint(vertex / grain)) for vertex in vertices)
    total = np.uint64(0)
    with np.errstate(over="ignore"):
        for start, end in ((first, second), (second, third), (third, first)):
            total = total + (keys(1, start, end) - keys(1, end, start)).sum(dtype=np.uint64)
    return bool(total == 0)


def _names(places: Floats) -> NDArray[np.uint64]:
    """Random numbers for places (3, T): equal for equal ones."""
    x, y, z = places.astype(np.int64)
    return keys(0, x, y, z)


def _solid_of(vertices: Floats) -> Solid:
    low, high = vertices.min(axis=2).min(axis=0), vertices.max(axis=2).max(axis=0)
    return Solid(low[:, None], high[:, None], _boxes_of(vertices, low, high))


def _boxes_of(vertices: Floats, low: Floats, high: Floats) -> Boxes:
    size = float((high - low).max()) / CELLS
    shape = np.maximum(1, np.ceil((high - low) / size)).astype(np.int64)
    inside = np.zeros(shape, dtype=bool)
    for pocket in _pockets(_untouched(vertices, low, size, shape)):
        place = low + (np.argwhere(pocket)[0] + 0.5) * size
        if abs(_turns(vertices, place[:, None])) > 0.5:
            inside |= pocket
    corners = list(_largest_boxes(inside))
    if not corners:
        return Boxes.none()
    begins, ends = (np.array(side, dtype=np.float64).T for side in zip(*corners, strict=True))
    room = ROUNDING * max(np.abs(low).max(), np.abs(high).max())
    return Boxes(low[:, None] + begins * size + room, low[:, None] + ends * size - room)


def _untouched(vertices: Floats, low: Floats, size: float, shape: Integers) -> Masks:
    """Cells that the bounds of no triangle touch, with room for rounding."""
    room = 2.0**-20
    last = shape[:, None] - 1
    begins = np.clip(np.floor((vertices.min(axis=0) - low[:, None]) / size - room).astype(np.int64), 0, last)
    ends = (
        np.clip(np.floor((vertices.max(axis=0) - low[:, None]) / size + room).astype(np.int64), 0, last) + 1
    )
    counts = np.zeros(shape + 1, dtype=np.int64)
    # Each triangle adds 1 to a box of cells: the differences at the eight corners, then sums along the axes.
    for corner in np.ndindex(2, 2, 2):
        place = [(begins, ends)[corner[axis]][axis] for axis in range(3)]
        added = np.bincount(np.ravel_multi_index(place, counts.shape), minlength=counts.size)
        counts += (-1) ** sum(corner) * added.reshape(counts.shape)
    for axis in range(3):
        np.cumsum(counts, axis=axis, out=counts)
    return counts[:-1, :-1, :-1] == 0


def _pockets(free: Masks) -> Iterator[Masks]:
    """Connected parts of the free cells that do not reach the border."""
    padded = np.pad(free, 1, constant_values=True)
    border = np.zeros_like(padded)
    border[0] = True
    rest = padded & ~_grown(border, padded)
    while rest.any():
        seed = np.zeros_like(rest)
        seed[tuple(np.argwhere(rest)[0])] = True
        pocket = _grown(seed, rest)
        rest &= ~pocket
        yield pocket[1:-1, 1:-1, 1:-1]


def _grown(seed: Masks, free: Masks) -> Masks:
    """All free cells that are connected to the seed."""
    while True:
        wider = seed.copy()
        for axis in range(3):
            ahead, behind = [slice(None)] * 3, [slice(None)] * 3
            ahead[axis], behind[axis] = slice(1, None), slice(None, -1)
            wider[tuple(ahead)] |= seed[tuple(behind)]
            wider[tuple(behind)] |= seed[tuple(ahead)]
        wider &= free
        if (wider == seed).all():
            return seed
        seed = wider


def _turns(vertices: Floats, place: Floats) -> float:
    """How often a mesh (3, 3, T) winds around a place (3, 1) (van Oosterom and Strackee 1983)."""
    a, b, c = vertices - place
    la, lb, lc = lengths(a), lengths(b), lengths(c)
    below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
    return float(np.arctan2(dot(a, cross(b, c)), below).sum() / (2 * np.pi))


def _largest_boxes(inside: Masks) -> Iterator[tuple[Integers, Integers]]:
    """First and last cells of boxes of cells, each grown around the middle of what no other covers."""
    left = inside.copy()
    for _ in range(MOST):
        depth = _depths(left)
        begin = np.array(np.unravel_index(np.argmax(depth), depth.shape))
        end = begin + 1
        if not depth.any():
            return
        _grow(inside, begin, end)
        if (end - begin).prod() < WORTH * inside.size:
            return
        yield begin, end
        left[tuple(slice(a, b) for a, b in zip(begin, end, strict=True))] = False


def _depths(cells: Masks) -> Integers:
    """How many layers of cells are around each."""
    depths, layer = np.zeros(cells.shape, dtype=np.int64), np.pad(cells, 1)
    while layer.any():
        depths += layer[1:-1, 1:-1, 1:-1]
        for axis in range(3):
            layer = layer & np.roll(layer, 1, axis) & np.roll(layer, -1, axis)
    return depths


def _grow(cells: Masks, begin: Integers, end: Integers) -> None:
    """Move the sides of a box out, one after the other, as long as all its cells are set."""
    moved = True
    while moved:
        moved = False
        for axis in range(3):
            for side, step in ((begin, -1), (end, 1)):
                side[axis] += step
                if _full(cells, begin, end):
                    moved = True
                else:
                    side[axis] -= step


def _full(cells: Masks, begin: Integers, end: Integers) -> bool:
    if (begin < 0).any() or (end > cells.shape).any():
        return False
    return bool(cells[tuple(slice(a, b) for a, b in zip(begin, end, strict=True))].all())
