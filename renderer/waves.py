"""Waves: rays with the same number of bounces, each with its throughput.

Mirrors and glass make trees of rays. All rays of one depth share waves, of whatever kind, because a wave of
few rays costs as much Python as a full one. The rays of one camera ray stay in the order of the previous ray,
then of the kind, so no bit depends on which other rays share a wave.
"""

from collections import Counter, deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from renderer.interaction import Points, Rays, first_of_each
from renderer.math.arrays import Floats, Integers, Masks, lengths, taken
from renderer.math.streams import bits, branch, keys, uniforms
from renderer.self_intersection import OriginSurfaces

CAMERA_RAY = -1
"""Kind of a ray that has not bounced."""

BOUNCES = ("mirror", "reflection", "refraction")
"""Ways in which a path continues; their indices select the random numbers."""

COUNTED_AS = {"mirror": "mirror", "reflection": "transmission", "refraction": "transmission"}
"""Kinds of rays in the report."""

MOST_RAYS = 1 << 15
"""Most rays of a wave. A depth with so many waiting rays goes first, which bounds the memory."""

CERTAIN_BOUNCES = 5
"""Bounces up to which all rays are followed: the default `max_depth`."""

THROUGHPUT_CUTOFF = 2.0**-12
"""Rays of smaller weights that leave the same point are replaced by one, chosen at random.

Eight balls of glass in one another, `max_depth` 64, 32 x 32 pixels: 9.7 CPU seconds; 5.4 with 2^-10, 17.5
with 2^-14. They do not end if all rays are followed.
"""

CHOICE_DIMENSIONS = 1 << 41
"""Stream of the choices between rays that leave a point."""


@dataclass(frozen=True, slots=True, eq=False)
class Wave:
    """Rays (N,) that have bounced equally often.

    Attributes
    ----------
    rays : Rays
    weights : (N,) float64
        Share of their radiance that reaches the camera.
    targets : (N,) int64
        Index of each ray's camera ray, ascending.
    parents : (N,) int64
        Index of the ray of the wave before that hit the point that each leaves.
    kinds : (N,) int64
        Place of the last bounce's kind in `BOUNCES`; `CAMERA_RAY` before the first.
    depth : int
        Bounces so far.
    """

    rays: Rays
    weights: Floats
    targets: Integers
    parents: Integers
    kinds: Integers
    depth: int

    @property
    def size(self) -> int:
        """Number of rays N."""
        return self.weights.size

    def count(self, counts: Counter[str]) -> None:
        """Add rays that have bounced to those of the report."""
        for kind, count in zip(
            BOUNCES, np.bincount(self.kinds, minlength=len(BOUNCES)).tolist(), strict=True
        ):
            counts[COUNTED_AS[kind]] += count

    def part(self, index: Integers) -> "Wave":
        """Some of the rays, which have left surfaces and hit nothing yet."""
        rays, start = self.rays, self.rays.origin_surfaces
        assert start is not None
        some = Rays(
            taken(rays.origins, index),
            taken(rays.directions, index),
            rays.pixels[index],
            rays.samples[index],
            origin_surfaces=start.part(index),
        )
        return Wave(
            some, self.weights[index], self.targets[index], self.parents[index], self.kinds[index], self.depth
        )


def camera_wave(rays: Rays) -> Wave:
    """Rays from the camera."""
    targets = np.arange(rays.t.size)
    return Wave(rays, np.ones(rays.t.size), targets, targets, np.full(rays.t.size, CAMERA_RAY), 0)


class WaitingWaves:
    """Waiting waves by depth."""

    def __init__(self, first: Iterable[Wave]) -> None:
        self._depths: list[deque[Wave]] = [deque()]
        self.add(first)

    def add(self, waves: Iterable[Wave]) -> None:
        """Add the successors of waves, in the order of the waves."""
        for wave in waves:
            if wave.depth == len(self._depths):
                self._depths.append(deque())
            self._depths[wave.depth].append(wave)

    def __bool__(self) -> bool:
        """Whether any wave waits."""
        return any(self._depths)

    def next(self) -> Wave:
        """The deepest rays that fill a wave; if none do, all of the shallowest."""
        full = [waves for waves in self._depths if sum(wave.size for wave in waves) >= MOST_RAYS]
        waves = full[-1] if full else next(waves for waves in self._depths if waves)
        taken_out = [waves.popleft()]
        while waves and sum(wave.size for wave in taken_out) + waves[0].size <= MOST_RAYS:
            taken_out.append(waves.popleft())
        return joined(taken_out)


def joined(waves: Sequence[Wave]) -> Wave:
    """Waves of one depth, which have left surfaces, one after the other."""
    if len(waves) == 1:
        return waves[0]
    rays = [wave.rays for wave in waves]
    every = Rays(
        np.concatenate([each.origins for each in rays], axis=1),
        np.concatenate([each.directions for each in rays], axis=1),
        np.concatenate([each.pixels for each in rays]),
        np.concatenate([each.samples for each in rays]),
        origin_surfaces=OriginSurfaces.joined(
            [each.origin_surfaces for each in rays if each.origin_surfaces]
        ),
    )
    weights, targets, parents, kinds = (
        np.concatenate([getattr(wave, name) for wave in waves])
        for name in ("weights", "targets", "parents", "kinds")
    )
    return Wave(every, weights, targets, parents, kinds, waves[0].depth)


def ordered(scattered: Sequence[Wave], seed: int) -> list[Wave]:
    """Rays that leave the points of one wave, by the ray before, then by kind, cut into waves."""
    if not scattered:
        return []
    every = joined(scattered)
    if len(scattered) == 1 and every.size <= MOST_RAYS:
        return [every]
    every = every.part(np.argsort(every.parents, kind="stable"))
    if every.depth > CERTAIN_BOUNCES:
        every = _thinned(every, seed)
    return [
        every.part(np.arange(start, min(start + MOST_RAYS, every.size)))
        for start in range(0, every.size, MOST_RAYS)
    ]


def _thinned(wave: Wave, seed: int) -> Wave:
    """One ray in place of the faint ones that leave a point, and of the next heavier one, chosen by weight.

    It has the weight of all of them, so that the expected contribution is that of all. The choice depends
    only on the numbers of the paths, so that no pixel depends on another.
    """
    faint = wave.weights < THROUGHPUT_CUTOFF
    heavy = np.flatnonzero(~faint)
    next_heavier = first_of_each(wave.parents[heavy], np.lexsort((wave.weights[heavy], wave.parents[heavy])))
    rivals = faint.copy()
    rivals[heavy[next_heavier]] = True
    rivals &= np.bincount(wave.parents, faint)[wave.parents] > 0
    index, start = np.flatnonzero(rivals), wave.rays.origin_surfaces
    assert start is not None
    path = wave.rays.pixels[index], wave.rays.samples[index], start.paths[index]
    numbers = uniforms(bits(keys(seed, CHOICE_DIMENSIONS, *path), 0))
    # The probability of the least of exponential random numbers is proportional to its rate.
    waits = -np.log1p(-numbers) / wave.weights[index]
    winners = index[first_of_each(wave.parents[index], np.lexsort((waits, wave.parents[index])))]
    weights = wave.weights.copy()
    weights[winners] = np.bincount(wave.parents[index], wave.weights[index])[wave.parents[winners]]
    rivals[winners] = False
    return replace(wave, weights=weights).part(np.flatnonzero(~rivals))


def leaving(
    wave: Wave,
    points: Points,
    chosen: Integers,
    directions: Floats,
    shares: Floats,
    outside: Masks,
    kind: str,
    faintest: float,
) -> tuple[Wave, ...]:
    """Rays from some of the points that a wave has hit, except those below the throughput cut-off.

    Parameters
    ----------
    wave : Wave
    points : Points
    chosen : (M,) int64
        Indices of the points.
    directions : (3, M) float64
    shares : (M,) float64
        Of the rays' weights.
    outside : (M,) bool
        Whether the new rays go to the outward side.
    kind : str
        One of `BOUNCES`.
    faintest : float
        Throughput cut-off; 0 ends only paths without contribution.
    """
    weights = wave.weights[points.rays[chosen]] * shares
    bright = np.flatnonzero(weights > faintest)
    if not bright.size:
        return ()
    start = chosen[bright]
    surfaces = OriginSurfaces(
        shapes=points.shapes[start],
        primitives=points.primitives[start],
        outside=outside[bright],
        sizes=points.sizes[start],
        previous_origins=_previous_origins(points, start, outside[bright]),
        paths=branch(points.paths[start], BOUNCES.index(kind)),
        path_lengths=points.path_lengths[start] + points.t[start] * lengths(points.directions[:, start]),
    )
    rays = Rays(
        origins=points.positions[:, start],
        directions=directions[:, bright],
        pixels=points.pixels[start],
        samples=points.samples[start],
        origin_surfaces=surfaces,
    )
    parents = points.rays[start]
    kinds = np.full(start.size, BOUNCES.index(kind))
    return (Wave(rays, weights[bright], wave.targets[parents], parents, kinds, wave.depth + 1),)


def _previous_origins(points: Points, start: Integers, outside: Masks) -> Floats:
    """Origins of the rays that ended at points `start` (M,), (3, 1) or (3, M).

    A ray that enters at an edge of glass may hit the adjacent face at once. After passing both, it is on no
    side of either, and does not hit them again.
    """
    previous = points.previous_origins_at(start)
    if points.previous_origins is points.origins:
        return previous
    passing = outside == points.flipped[start]
    return np.where(points.went_nowhere(start) & passing, points.positions[:, start], previous)
