"""One light as seen from a chunk of points: facing points, blocked pairs, distances."""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from renderer.interaction import Points
from renderer.lights.emitters import Emitter
from renderer.lights.samples import Frame, LightPoints, Terms
from renderer.math.arrays import Floats, Integers, Masks, Pairs, dot, lengths, magnitude, taken
from renderer.math.numerics import gamma, halving_sum
from renderer.workspace import Workspace

Value = TypeVar("Value", bound=np.generic)


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """Weight of light samples: a weight per pair times a factor per point.

    Attributes
    ----------
    pairs : (L, n) float32 or float64
        From 0 to 1.
    factors : (n,) float64
    """

    pairs: Pairs
    factors: Floats

    def times(self, other: "Weights") -> "Weights":
        """The product of two, pair by pair."""
        return Weights(self.pairs * other.pairs, self.factors * other.factors)

    def part(self, index: Integers) -> "Weights":
        """Select points (m,)."""
        return Weights(np.take(self.pairs, index, axis=1), self.factors[index])


@dataclass(slots=True, eq=False)
class LightView:
    """n points that face a light, and the pair arrays of shape (L, n) about them.

    Attributes
    ----------
    emitter : Emitter
    points : Points
        The chunk that the n points belong to.
    chosen : (n,) int64
        Indices of the points in the chunk.
    light_points : LightPoints
    towards : (3, n) float64
        Light centre minus point.
    origins : (3, 1) or (3, n) float64
        Origins of the rays.
    dtype : float32 or float64
        Of pair work.
    blocked : (L, n) bool or None
        Pairs with a shape between; None before the first.
    weights : Weights or None
        The product of the weights of all stages; None as long as all light points count equally.
    """

    emitter: Emitter
    points: Points
    chosen: Integers
    light_points: LightPoints
    towards: Floats
    origins: Floats
    dtype: np.dtype[np.floating]
    workspace: Workspace
    blocked: Masks | None = None
    weights: Weights | None = None
    _distances: Floats | None = None
    _scale: Floats | None = None
    _inverse: Pairs | None = None
    _open: Masks | None = None

    @property
    def count(self) -> int:
        """Number of points n."""
        return self.chosen.size

    def of_points(self, values: NDArray[Value]) -> NDArray[Value]:
        """Values of the chunk, (..., M), at the n points."""
        return values if self.count == values.shape[-1] else taken(values, self.chosen)

    def weigh(self, weights: Weights) -> None:
        """Multiply the weights of the light points."""
        self.weights = weights if self.weights is None else self.weights.times(weights)

    def open_points(self) -> Integers:
        """Points (m,) that some light point may still be seen from."""
        if self.blocked is None:
            return np.arange(self.count)
        return np.flatnonzero(~np.logical_and.reduce(self.blocked, axis=0))

    def block(self, mask: Masks, index: Integers | None = None) -> None:
        """Add blocked pairs: `mask` (L, n), or (L, m) for the points `index` (m,)."""
        if self.blocked is None:
            self.blocked = self.workspace.masks("blocked", self.light_points.count, self.count)
            self.blocked[...] = False
        if index is not None:
            mask = self._spread(mask, index)
        np.logical_or(self.blocked, mask, out=self.blocked)

    def _spread(self, mask: Masks, index: Integers) -> Masks:
        """A mask of some points as one of all, by gathering, which is faster than scattering."""
        padded = self.workspace.masks("padded", mask.shape[0], index.size + 1)
        padded[:, :-1], padded[:, -1] = mask, False
        sources = np.full(self.count, index.size)
        sources[index] = np.arange(index.size)
        return np.take(
            padded,
            sources,
            axis=1,
            out=self.workspace.masks("gathered", mask.shape[0], self.count),
            mode="clip",
        )

    def drop_dark(self) -> None:
        """Leave out the points that see no light point."""
        if self.blocked is None:
            return
        lit = self.open_points()
        if lit.size < self.count:
            self.blocked = np.take(self.blocked, lit, axis=1)
            self.chosen, self.towards = self.chosen[lit], taken(self.towards, lit)
            self._distances = self._scale = None
            self.light_points = self.light_points.chosen(lit)
            if self.origins.shape[1] > 1:
                self.origins = taken(self.origins, lit)

    def pairs(self, name: str) -> Pairs:
        """An (L, n) buffer."""
        return self.workspace.pairs(name, self.light_points.count, self.count, self.dtype)

    def distances(self) -> Floats:
        """Distances (n,) to the light's centre, scene units."""
        if self._distances is None:
            self._distances = lengths(self.towards)
        return self._distances

    def scale(self) -> Floats:
        """One over the distance to the light or its size, whichever is larger: pair work has no units."""
        if self._scale is None:
            size = np.maximum(
                magnitude(self.towards), magnitude(self.emitter.first) + magnitude(self.emitter.second)
            )
            self._scale = 1 / np.where(size > 0, size, 1.0)
        return self._scale

    def terms(self, vectors: Floats) -> Terms:
        """M . (q - p) in the points' own scale, for vectors m (3, n), as an affine function on the light."""
        scale = self.scale()
        return (
            dot(vectors, self.towards) * scale,
            dot(vectors, self.emitter.first) * scale,
            dot(vectors, self.emitter.second) * scale,
        )

    def cosines(self, vectors: Floats, out: Pairs) -> Pairs:
        """max(0, m . l) for vectors m (3, n) and the unit directions l to the light points, (L, n)."""
        self.light_points.affine(self.terms(vectors), out, self.workspace)
        np.maximum(out, 0, out=out)
        np.multiply(out, self.inverse_distances(), out=out)
        return out

    def frame(self) -> Frame:
        """Position of the light relative to the points, scaled per point."""
        emitter, scale = self.emitter, self.scale()
        return Frame(
            across=-dot(self.towards, emitter.across) * scale,
            along=-dot(self.towards, emitter.along) * scale,
            away=-dot(self.towards, emitter.normal) * scale,
            first=dot(emitter.first, emitter.across) * scale,
            second_across=dot(emitter.second, emitter.across) * scale,
            second_along=dot(emitter.second, emitter.along) * scale,
        )

    def inverse_distances(self) -> Pairs:
        """One over the distances, in the points' own scale, (L, n)."""
        if self._inverse is None:
            squares = self.light_points.squared_distances(self.frame(), self.pairs("inverse"), self.workspace)
            np.maximum(squares, np.finfo(self.dtype).tiny, out=squares)
            np.sqrt(squares, out=squares)
            self._inverse = np.reciprocal(squares, out=squares)
        return self._inverse

    def positive_cosines(self, vectors: Floats) -> Masks | None:
        """Pairs with m . l > 0 for vectors m (3, n); None if all are, with room for rounding."""
        constant, by_u, by_v = terms = self.terms(vectors)
        # Pair work rounds these terms to float32, and its sums: 2**-18 is 64 such roundings of a term of 1.
        if np.all(constant - np.abs(by_u) / 2 - np.abs(by_v) / 2 > 2.0**-18):
            return None
        return self.light_points.affine(terms, self.pairs("positive"), self.workspace) > 0

    def above_horizon(self, normals: Floats) -> Masks:
        """Pairs whose light point is above the horizon of normals (3, n), (L, n)."""
        positive = self.positive_cosines(normals)
        return np.ones((self.light_points.count, self.count), dtype=bool) if positive is None else positive

    def block_below_horizon(self) -> None:
        """Block the pairs whose light point is behind the true surface, whatever the shading normal says."""
        positive = self.positive_cosines(self.of_points(self.points.normals))
        if positive is not None:
            self.block(~positive)

    def mean(self, values: Pairs) -> Floats:
        """Mean (n,) over the light points of V * g * values (L, n), where V and g are 1 unless set.

        Overwrites `values`.
        """
        self._keep_open(values)
        if self.weights is not None:
            np.multiply(values, self.weights.pairs, out=values)
        mean = halving_sum(values).astype(np.float64) / self.light_points.count
        return mean if self.weights is None else mean * self.weights.factors

    def _keep_open(self, values: Pairs) -> None:
        """Set the values (L, n) of blocked pairs to 0."""
        if self.blocked is None:
            return
        if self._open is None:
            self._open = np.logical_not(self.blocked)
        np.multiply(values, self._open, out=values)

    def part(self, index: Integers, dtype: np.dtype[np.floating]) -> "LightView":
        """The view of some of the points (m,), with pair work in `dtype`."""
        if index.size == self.count and dtype == self.dtype:
            return self
        return replace(
            self,
            chosen=self.chosen[index],
            towards=taken(self.towards, index),
            light_points=self.light_points.chosen(index),
            origins=self.origins if self.origins.shape[1] == 1 else taken(self.origins, index),
            dtype=dtype,
            blocked=None if self.blocked is None else np.take(self.blocked, index, axis=1),
            weights=None if self.weights is None else self.weights.part(index),
            _distances=self.distances()[index],
            _scale=self.scale()[index],
            _inverse=np.take(self.inverse_distances(), index, axis=1) if dtype == self.dtype else None,
            _open=None,
        )

    def repeated(self, points: Points, index: Integers, times: int) -> "LightView":
        """The view of other points (times m,): some of the chunk's (m,), in order, that many times.

        These see light points as their originals do. Assumes that all points share the light points, and that
        weights say what is blocked.
        """
        which = np.full(self.points.count, -1)
        which[self.chosen] = np.arange(self.count)
        kept = np.flatnonzero(which[index] >= 0)
        part = self.part(which[index[kept]], self.dtype)
        weights = part.weights
        return replace(
            part,
            points=points,
            chosen=(kept + index.size * np.arange(times)[:, None]).ravel(),
            towards=np.tile(part.towards, times),
            origins=part.origins if part.origins.shape[1] == 1 else np.tile(part.origins, times),
            weights=weights and Weights(np.tile(weights.pairs, times), np.tile(weights.factors, times)),
            _distances=np.tile(part.distances(), times),
            _scale=np.tile(part.scale(), times),
            _inverse=np.tile(part.inverse_distances(), times),
        )


def facing(emitter: Emitter, points: Points, towards: Floats) -> Masks:
    """Points with some light point above the horizon of both normals, where the light shines to.

    A light in the plane of the receiver is at the horizon: within rounding of 0 counts as 0.
    """
    lit = _reaches(emitter, points.normals, towards)
    if points.bent:
        lit &= _reaches(emitter, points.shading_normals, towards)
    if emitter.least_cosine is not None:
        rounding = gamma(16) * magnitude(towards)
        lit &= dot(towards, emitter.normal) < -emitter.least_cosine * lengths(towards) - rounding
    return lit


def _reaches(emitter: Emitter, normals: Floats, towards: Floats) -> Masks:
    extent = np.abs(dot(normals, emitter.first)) + np.abs(dot(normals, emitter.second))
    rounding = gamma(32) * (magnitude(towards) + emitter.size)
    return dot(normals, towards) + extent / 2 > rounding
