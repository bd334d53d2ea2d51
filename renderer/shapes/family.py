"""Interface of families of shapes, and the shapes of a family that a block of rays may hit."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from renderer.cameras import Pinhole
from renderer.interaction import Points, Rays
from renderer.math.arrays import Floats, Integers, Masks, put, taken

HULL_MARGIN = 2.0**-40
"""Relative margin of conservative tests: thousands of roundings wide, and far below a pixel."""


SINGLE_PRIMITIVE = np.zeros(1, dtype=np.int64)
"""Primitive number of shapes that have only one."""


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """Corners of the convex hulls of K shapes in the camera's coordinates, each (V, K).

    `blur` is how far a ray through the lens may pass from the one through its middle, at the corner's depth.
    """

    right: Floats
    up: Floats
    forward: Floats
    blur: Floats

    @classmethod
    def of(cls, corners: Floats, camera: Pinhole) -> "Outline":
        """From world corners (V, 3, K)."""
        relative = corners - camera.position

        def along(axis: Floats) -> Floats:
            return relative[:, 0] * axis[0] + relative[:, 1] * axis[1] + relative[:, 2] * axis[2]

        forward = along(camera.forward)
        return cls(along(camera.right), along(camera.up), forward, camera.blur(forward))

    def inside(self, screen: Floats) -> Masks:
        """Shapes that rays through a part of the screen may hit, (K,); never leaves one out that they do.

        A ray through (x, y) keeps right = x * forward and up = y * forward, give or take the blur. If all
        corners of a hull lie beyond it on one side of a plane that bounds all rays, so does every point of
        the hull, because the blur is convex in the depth.
        """
        slack = HULL_MARGIN * (
            np.abs(self.right) + np.abs(self.up) + np.abs(self.forward) * (1 + np.abs(screen).max())
        )
        slack = slack + self.blur
        left, right, bottom, top = screen
        return ~(
            np.all(self.right - left * self.forward < -slack, axis=0)
            | np.all(self.right - right * self.forward > slack, axis=0)
            | np.all(self.up - bottom * self.forward < -slack, axis=0)
            | np.all(self.up - top * self.forward > slack, axis=0)
            | np.all(self.forward < -slack, axis=0)
        )


def box(centers: Floats, axes: Floats) -> Floats:
    """Corners (8, 3, K) of boxes by their centres (3, K) and half their edges (3, 3, K), edge by edge."""
    signs = [(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
    return np.stack([centers + i * axes[0] + j * axes[1] + k * axes[2] for i, j, k in signs])


@dataclass(slots=True, weakref_slot=True, eq=False)
class Family(ABC):
    """Shapes of one kind as arrays over K shapes.

    Attributes
    ----------
    kind : str
        Type of the shapes in the scene language.
    numbers : (K,) int64
        Number of each shape in the order of the scene.
    sizes : (K,) float64
        Sum of the magnitudes that form a point on the shape, scene units.
    """

    kind: str
    numbers: Integers
    sizes: Floats

    @property
    def plural(self) -> str:
        """Several of its kind, in words."""
        return self.kind + ("es" if self.kind.endswith("sh") else "s")

    def part(self, kept: Masks | Integers) -> Self:
        """The family of some primitives, by a mask (K,) or their numbers in it.

        Points are located only in a family that has all primitives of a shape, or none.
        """
        arrays = (item.name for item in fields(self) if item.name != "kind")
        return type(self)(self.kind, **{name: getattr(self, name)[..., kept] for name in arrays})

    @abstractmethod
    def corners(self) -> Floats:
        """Corners of a convex hull of each shape, (V, 3, K): without edges those that `box` gives."""

    def edges(self) -> tuple[tuple[int, int], ...]:
        """Pairs of corners with an edge of the shape between them; none for curved shapes."""
        return ()

    @property
    @abstractmethod
    def surface(self) -> str:
        """Kind of surface: only families of the same kind may coincide."""

    @abstractmethod
    def coincide(self, own: Integers, other: "Family", others: Integers) -> Masks:
        """Whether primitives (P,) and others of a family of the same `surface` share an area.

        There rays hit both, in an order that rounding decides.
        """

    def signatures(self, origin: Floats, direction: Floats, reach: float) -> tuple[Floats, Floats]:
        """A number and a room for each primitive, (K,): of two that coincide the rooms meet.

        They separate most others, by a place and a vector, (3, 1) each, that no shape is likely to be in line
        with. `reach` is the greatest of the `reaches` of all. A room is NaN for what has no area; here it is
        endless, and separates nothing.
        """
        del origin, direction, reach
        return np.zeros(self.numbers.size), np.full(self.numbers.size, np.inf)

    def reaches(self) -> Floats:
        """Magnitudes, at most `sizes`, whose roundings may move a surface off others, (K,)."""
        return self.sizes

    @abstractmethod
    def shades_itself(self, viewer: Floats | None) -> bool:
        """Whether a single shape in a scene can shade itself, as seen from `viewer`.

        `viewer` is a point (3, 1), or None if it is unknown. A flat shape never does, a convex solid only if
        seen from inside.
        """

    @abstractmethod
    def smooth_shapes(self) -> Integers:
        """Numbers of the shapes whose shading normals are not those of the surface, (M,)."""

    def without_area(self) -> Masks:
        """Primitives that nothing can hit, as they have no area, (K,)."""
        return np.zeros(self.numbers.size, dtype=bool)

    def count_retried(self) -> int:
        """Number of primitives so thin that exact arithmetic had to decide if they have an area."""
        return 0

    def reach(self, direction: Floats) -> Floats:
        """Greatest value of direction . x over the places x of each shape, (K,), for a vector (3, 1).

        Rounding error at most gamma(16) times the shape's size, for a unit vector.
        """
        corners = self.corners()
        along = corners[:, 0] * direction[0] + corners[:, 1] * direction[1] + corners[:, 2] * direction[2]
        return along.max(axis=0)

    @abstractmethod
    def intersect(self, shape: int, rays: Rays) -> None:
        """Offer the rays their hits with one shape of the family."""

    @abstractmethod
    def locate(self, points: Points, chosen: Integers, shapes: Integers) -> None:
        """Fill in position and normals of the points `chosen` (m,).

        `shapes` (m,) are their numbers within the family.
        """

    def coordinates(self, points: Points, chosen: Integers, shapes: Integers) -> Floats:
        """Texture coordinates of such points, (2, m): by default those of the surface."""
        del shapes
        return taken(points.hits[:2], chosen)

    @abstractmethod
    def frames(self, points: Points, chosen: Integers, shapes: Integers) -> tuple[Floats, Floats]:
        """Unit tangents (3, m), in which u grows, and the handedness (m,) of the texture coordinates."""

    @abstractmethod
    def derivatives(self, points: Points, chosen: Integers, shapes: Integers) -> tuple[Floats, Floats]:
        """Derivatives (3, m) of the position by the texture coordinates u and v, scene units.

        Zero where the texture coordinates do not say.
        """


@dataclass(frozen=True, slots=True)
class Intersector:
    """Stage: the nearest hits of a block of rays with one family."""

    family: Family
    outline: Outline | None

    def run(self, rays: Rays) -> None:
        """Offer hits with every shape of the family that the block may hit."""
        if self.outline is None or rays.screen is None:
            candidates = np.arange(self.family.numbers.shape[0])
        else:
            candidates = np.flatnonzero(self.outline.inside(rays.screen))
        for shape in candidates.tolist():
            self.family.intersect(shape, rays)


OPTIONAL_ROWS = {"coordinates": 2, "frames": 4, "derivatives": 6}
"""Rows of the point fields that are computed only for a stage that reads them, by field; each has a method of
this name, and the first is input of the others."""


@dataclass(frozen=True, slots=True, eq=False)
class Location:
    """Stage: positions and normals of points, and what else is read of them.

    Attributes
    ----------
    families : tuple of Family
    local : (families, shapes of the scene) int64
        Place within the family of the first primitive of each shape of the scene, -1 for shapes of others.
    reads : frozenset of str
        Names of `OPTIONAL_ROWS` that stages read.
    """

    families: tuple[Family, ...]
    local: Integers
    reads: frozenset[str]

    def run(self, points: Points) -> None:
        """Fill in the points."""
        groups = [name for name in OPTIONAL_ROWS if name in self.reads]
        for name in groups:
            setattr(points, name, np.empty((OPTIONAL_ROWS[name], points.count)))
        for family, local in zip(self.families, taken(self.local, points.shapes), strict=True):
            chosen = np.flatnonzero(local >= 0)
            if chosen.size:
                shapes = local[chosen] + points.primitives[chosen]
                family.locate(points, chosen, shapes)
                points.sizes[chosen] = family.sizes[shapes]
                for name in groups:
                    values = getattr(family, name)(points, chosen, shapes)
                    put(getattr(points, name), chosen, np.vstack(values))
