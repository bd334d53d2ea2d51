"""Fine texture: pixels shaded at many places of their surface, in the light that their centres see."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from renderer.adaptive.arrivals import Arrival, sides_for
from renderer.interaction import Points
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.materials.maps import ColorTexture
from renderer.materials.reflection import LightTerm
from renderer.math.arrays import Floats, Integers, Masks, put, taken
from renderer.math.numerics import halving_sum
from renderer.plan.stages import Illumination, PointStage
from renderer.workspace import Workspace

LATTICES = {3: 2, 5: 3, 8: 5, 13: 8, 21: 13, 34: 21, 55: 34, 89: 55, 144: 89}
"""Places in a pixel, and the number that makes them a Fibonacci lattice (`levels.FIBONACCI`)."""

SIZES = np.array(list(LATTICES))

FALL = 2.3
"""The squared error of a mean is the variance of places over this power of their number: 2.1 to 3.3, over the
pixels of three scenes at two sizes, with 5 to 34 places."""

POWER = 0.6
"""Places are proportional to the deviation within the pixel to this power, 2 / (1 + `FALL`): the least work
for a sum of squared errors."""

ALLOWED = 0.4
"""Deviation, in requested errors, of pixels that a single place is enough for at an error of 1/255; in
proportion to the error, so that what is left calls for no samples. With 0.8, 0.5/255 takes them: 4.1 s, not
1.8 (normal_texturing), and with 0.2, 1/255 takes a third more places for errors that are 10 % smaller."""

COARSE = 1.5 / 255
"""For errors from this one on, fewer places show how many a pixel needs."""

FIRST_COARSE, FIRST_FINE, MOST_FIRST = (3, 0.25), (5, 0.5), 34
"""Places of the first lattice: at least, for each texel that a pixel covers, and at most. Fewer miss what is
thin: with 3, the error at 1/255 is that of 5 and a half times as large, and all pixels are sampled."""

INCOHERENT = 1024
"""Texels that a pixel covers from which on its places are as good as random: the first power."""

TOGETHER = 16384
"""Places shaded at once: arrays stay in cache."""


def lattice(count: int) -> Floats:
    """Offsets (2, count, 1) from a pixel's centre, in sides of it: symmetric, so that slopes cancel."""
    index, turn = np.arange(count), LATTICES[count]
    along = (index - (count - 1) / 2) * turn / count + 0.5
    return np.stack(((index + 0.5) / count, along - np.floor(along)))[:, :, None] - 0.5


class Places(Points):
    """Points all over pixels: their centres, once for each of K places, with other texture coordinates.

    What a stage reads is copied then, and what none reads never. The m points of the first place come first.

    Parameters
    ----------
    centers : Points
    chosen : (m,) int64
        Which of them.
    offsets : (2, K, 1) float64
        From the centres, in sides of a pixel.
    """

    __slots__ = ("_centers", "_chosen", "_times")

    def __init__(self, centers: Points, chosen: Integers, offsets: Floats) -> None:
        self._centers, self._chosen, self._times = centers, chosen, offsets.shape[1]
        across, along = taken(centers.footprints, chosen).swapaxes(0, 1)[:, :, None]
        moved = taken(centers.coordinates, chosen)[:, None] + across * offsets[0] + along * offsets[1]
        self.coordinates = moved.reshape(2, -1)
        self.radiance = np.zeros((3, self.coordinates.shape[1]))

    def __getattr__(self, name: str) -> Any:
        """Copy what the centres have, when it is first read."""
        value = getattr(self._centers, name)
        if isinstance(value, np.ndarray) and value.shape[-1] == self._centers.count:
            value = np.tile(taken(value, self._chosen), self._times)
        setattr(self, name, value)
        return value

    def footprints_at(self, index: Integers) -> None:
        """None: places take no mean."""
        del index


@dataclass(frozen=True, slots=True, eq=False)
class FineTexture:
    """All lights of a plan, at hits some of which have a fine texture.

    Attributes
    ----------
    plain : tuple of Illumination
        The lights for materials without.
    arrivals : dict of int to tuple of Arrival
        The lights for those with a fine texture, by the places along a side.
    maps : tuple of PointStage
        What gives these their colours, normals and ambient light.
    texels : (materials,) float64
        Of the largest image of each material with a fine texture; 0 for others.
    relief : (materials,) bool
        Those with maps of normals or heights.
    error : float
        That the mean over a pixel may have.
    """

    plain: tuple[Illumination, ...]
    arrivals: dict[int, tuple[Arrival, ...]]
    maps: tuple[PointStage, ...]
    texels: Floats
    relief: Masks
    error: float

    @property
    def emitter(self) -> Emitter:
        """The light with most points."""
        return max((light.emitter for light in self.plain), key=lambda emitter: emitter.count)

    @property
    def casts(self) -> bool:
        """Whether anything can stand in the way of some light."""
        return any(light.casts for light in self.plain)

    def run(self, points: Points, workspace: Workspace) -> int:
        """Add the lights to the points' radiance; gives the number of shadow rays."""
        fine = self.texels[points.materials] > 0
        rays = 0
        if not fine.all():
            chosen = np.flatnonzero(~fine)
            part = points.part(chosen)
            rays += sum(light.run(part, workspace) for light in self.plain)
            put(points.radiance, chosen, part.radiance)
        emitters = (light.emitter for light in self.plain)
        sides = sides_for(emitters, points.positions, self.error) * fine
        for side, arrivals in self.arrivals.items():
            chosen = np.flatnonzero(sides == side)
            if chosen.size:
                rays += self._run_fine(points, chosen, arrivals, workspace)
        return rays

    def _run_fine(
        self, points: Points, chosen: Integers, arrivals: tuple[Arrival, ...], workspace: Workspace
    ) -> int:
        """Give points their means over pixels.

        What they have so far is that of the smooth surface, without maps. Their colours become the share of
        its radiance that they reflect with maps.
        """
        smooth = points.part(chosen)
        arriving = [arrival.view(smooth) for arrival in arrivals]
        views = [view for view, _ in arriving]
        relief, terms = self.relief[smooth.materials], [arrival.terms for arrival in arrivals]
        highlights = np.zeros((3, chosen.size))
        pixels = Pixels(smooth, relief, highlights, self.maps, views, terms, workspace)
        pixels.light_smooth()
        values, doubts = self._means(pixels)
        colors = np.divide(values, smooth.radiance, out=np.ones_like(values), where=smooth.radiance > 0)
        points.doubts[chosen] = doubts
        put(points.radiance, chosen, values)
        put(points.colors, chosen, colors)
        return sum(rays for _, rays in arriving)

    def _means(self, pixels: "Pixels") -> tuple[Floats, Floats]:
        """Mean radiance (3, n), and squared errors (n,) to expect of it.

        A first lattice, the larger the more texels a pixel covers, finds out how many places it needs.
        """
        points = pixels.smooth
        across, along = points.footprints.swapaxes(0, 1)
        areas = np.abs(across[0] * along[1] - across[1] * along[0]) * self.texels[points.materials]
        least, share = FIRST_COARSE if self.error >= COARSE else FIRST_FINE
        first = np.searchsorted(SIZES, np.clip(share * areas, least, MOST_FIRST))
        values, deviations = np.empty((3, points.count)), np.empty(points.count)
        pixels.shade(first, np.arange(points.count), values, deviations)
        needed = (deviations / (ALLOWED * 255 * self.error**2)) ** POWER
        levels = np.clip(np.searchsorted(SIZES, needed), first, SIZES.size - 1)
        pixels.shade(levels, np.flatnonzero(levels > first), values, np.empty(points.count))
        places = SIZES[levels]
        return values, deviations**2 / places ** np.where(areas > INCOHERENT, 1.0, FALL)


@dataclass(frozen=True, slots=True, eq=False)
class Pixels:
    """All that shading needs of n pixels.

    Attributes
    ----------
    smooth : Points
        Their centres, without what maps give.
    relief : (n,) bool
        Whether maps bend their normals.
    highlights : (3, n) float64
        Of the centres that have no relief.
    maps : sequence of PointStage
    views : sequence of LightView
        Each light at the centres.
    terms : sequence of tuples of LightTerm
        Of each light.
    workspace : Workspace
    """

    smooth: Points
    relief: Masks
    highlights: Floats
    maps: Sequence[PointStage]
    views: Sequence[LightView]
    terms: Sequence[tuple[LightTerm, ...]]
    workspace: Workspace

    def light_smooth(self) -> None:
        """Add what the smooth surface shows to the centres' radiance, and to `highlights`."""
        shiny = copy(self.smooth)
        shiny.radiance = self.highlights
        for view, terms in zip(self.views, self.terms, strict=True):
            for term in terms if view.count else ():
                if term.adds == "diffuse":
                    term.run(view)
                elif not self.relief.all():
                    term.run(replace(view, points=shiny))

    def shade(self, levels: Integers, chosen: Integers, values: Floats, deviations: Floats) -> None:
        """Shade some pixels (m,), each at the places of its lattice, `levels` (n,) in `SIZES`.

        Their means go into `values` (3, n), standard deviations of single places into `deviations` (n,).
        """
        kinds = 2 * levels[chosen] + self.relief[chosen]
        for kind in np.unique(kinds).tolist():
            level, relief = divmod(kind, 2)
            alike, offsets = chosen[kinds == kind], lattice(int(SIZES[level]))
            radiance = self._bent if relief else self._colored
            step = max(TOGETHER // offsets.shape[1], 1)
            for start in range(0, alike.size, step):
                index = alike[start : start + step]
                means, deviations[index] = _moments(radiance(index, offsets))
                put(values, index, means)

    def _colored(self, index: Integers, offsets: Floats) -> Floats:
        """Radiance (K, 3, m) at places of some pixels (m,) on which only colours vary, highlights do not."""
        places = Places(self.smooth, index, offsets)
        for stage in self.maps:
            if isinstance(stage, ColorTexture):
                stage.run(places)
        colors = places.colors.reshape(3, -1, index.size).swapaxes(0, 1)
        return colors * taken(self.smooth.radiance, index) + taken(self.highlights, index)

    def _bent(self, index: Integers, offsets: Floats) -> Floats:
        """Radiance (K, 3, m) at places of some pixels (m,) with a relief."""
        times = offsets.shape[1]
        places = Places(self.smooth, index, offsets)
        for stage in self.maps:
            stage.run(places)
        for view, terms in zip(self.views, self.terms, strict=True):
            repeated = view.repeated(places, index, times)
            for term in terms if repeated.count else ():
                term.run(repeated)
        return places.radiance.reshape(3, times, index.size).swapaxes(0, 1).copy()


def _moments(radiance: Floats) -> tuple[Floats, Floats]:
    """Means (3, m) over places, and standard deviations (m,) of what they show, clipped to white."""
    count = len(radiance)
    shown = np.minimum(radiance, 1)
    shown -= halving_sum(shown.copy()) / count
    deviations = np.sqrt(halving_sum(shown * shown).mean(axis=0) / count)
    return halving_sum(radiance) / count, deviations
