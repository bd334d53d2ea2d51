"""Decoupled shading of fine texture: many texture points a pixel share the incident light of its centre."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from renderer.adaptive.quadrature import Quadrature, sides_for
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
"""Sizes and generators of Fibonacci lattices of texture points in a pixel."""

SIZES = np.array(list(LATTICES))

VARIANCE_EXPONENT = 2.3
"""The squared error of a mean is the variance of the points over this power of their number: 2.1 to 3.3, over
the pixels of three scenes at two sizes, with 5 to 34 points."""

COUNT_EXPONENT = 0.6
"""Points are proportional to the standard deviation within the pixel to this power, 2 / (1 + exponent above):
Neyman allocation."""

SINGLE_POINT_DEVIATION = 0.4
"""Standard deviation, in target errors, of pixels for which a single point suffices at 1/255; in proportion
to the error, so that the rest needs no samples. With 0.8, 0.5/255 samples it: 4.1 s, not 1.8
(normal_texturing), and with 0.2, 1/255 takes a third more points for errors that are 10 % smaller."""

COARSE_ERROR = 1.5 / 255
"""Least target error with a coarser first lattice."""

FIRST_COARSE, FIRST_FINE, MAX_FIRST = (3, 0.25), (5, 0.5), 34
"""Points of the first lattice: at least, for each texel that a pixel covers, and at most. Fewer miss thin
detail: with 3, the error at 1/255 is one and a half times that with 5, and all pixels are sampled."""

INCOHERENT_TEXELS = 1024
"""Texels in a pixel from which on points are as good as random: the exponent is 1."""

BLOCK_POINTS = 16384
"""Points shaded at once: arrays stay in cache."""


def lattice(count: int) -> Floats:
    """Offsets (2, count, 1) from a pixel's centre, in pixels: symmetric, so that slopes cancel."""
    index, turn = np.arange(count), LATTICES[count]
    along = (index - (count - 1) / 2) * turn / count + 0.5
    return np.stack(((index + 0.5) / count, along - np.floor(along)))[:, :, None] - 0.5


class TexturePoints(Points):
    """Texture points of pixels: their centres, repeated K times with other texture coordinates.

    Attributes are copied when a stage first reads them. The m points at the first offset come first.

    Parameters
    ----------
    centers : Points
    chosen : (m,) int64
        Indices of the pixels.
    offsets : (2, K, 1) float64
        From the centres, in pixels.
    """

    __slots__ = ("_centers", "_chosen", "_times")

    def __init__(self, centers: Points, chosen: Integers, offsets: Floats) -> None:
        self._centers, self._chosen, self._times = centers, chosen, offsets.shape[1]
        across, along = taken(centers.footprints, chosen).swapaxes(0, 1)[:, :, None]
        moved = taken(centers.coordinates, chosen)[:, None] + across * offsets[0] + along * offsets[1]
        self.coordinates = moved.reshape(2, -1)
        self.radiance = np.zeros((3, self.coordinates.shape[1]))

    def __getattr__(self, name: str) -> Any:
        """Repeat an attribute of the centres when it is first read."""
        value = getattr(self._centers, name)
        if isinstance(value, np.ndarray) and value.shape[-1] == self._centers.count:
            value = np.tile(taken(value, self._chosen), self._times)
        setattr(self, name, value)
        return value

    def footprints_at(self, index: Integers) -> None:
        """None: points are no means."""
        del index


@dataclass(frozen=True, slots=True, eq=False)
class FineTexture:
    """Direct lighting from all lights, with decoupled shading of materials that have fine texture.

    Attributes
    ----------
    plain : tuple of Illumination
        Lights for other materials.
    quadratures : dict of int to tuple of Quadrature
        Lights for fine texture, by nodes along a side.
    maps : tuple of PointStage
        Stages of its colours, normals and ambient light.
    texels : (materials,) float64
        Of the largest image of each material with fine texture; 0 for others.
    relief : (materials,) bool
        Those with maps of normals or heights.
    error : float
        Target error of the mean over a pixel.
    """

    plain: tuple[Illumination, ...]
    quadratures: dict[int, tuple[Quadrature, ...]]
    maps: tuple[PointStage, ...]
    texels: Floats
    relief: Masks
    error: float

    @property
    def emitter(self) -> Emitter:
        """The light with the most points."""
        return max((light.emitter for light in self.plain), key=lambda emitter: emitter.count)

    @property
    def casts(self) -> bool:
        """Whether anything may occlude one of the lights."""
        return any(light.casts for light in self.plain)

    def run(self, points: Points, workspace: Workspace) -> int:
        """Add the lights to the points' radiance; return the number of shadow rays."""
        fine = self.texels[points.materials] > 0
        rays = 0
        if not fine.all():
            chosen = np.flatnonzero(~fine)
            part = points.part(chosen)
            rays += sum(light.run(part, workspace) for light in self.plain)
            put(points.radiance, chosen, part.radiance)
        emitters = (light.emitter for light in self.plain)
        sides = sides_for(emitters, points.positions, self.error) * fine
        for side, quadratures in self.quadratures.items():
            chosen = np.flatnonzero(sides == side)
            if chosen.size:
                rays += self._run_fine(points, chosen, quadratures, workspace)
        return rays

    def _run_fine(
        self, points: Points, chosen: Integers, quadratures: tuple[Quadrature, ...], workspace: Workspace
    ) -> int:
        """Set radiance to means over pixels, and colours to its ratio to the radiance without maps.

        So far the points have the radiance and colours of the surface without maps.
        """
        smooth = points.part(chosen)
        arriving = [quadrature.view(smooth) for quadrature in quadratures]
        views = [view for view, _ in arriving]
        relief, terms = self.relief[smooth.materials], [quadrature.nodes.terms for quadrature in quadratures]
        highlights = np.zeros((3, chosen.size))
        pixels = PixelShading(smooth, relief, highlights, self.maps, views, terms, workspace)
        pixels.light_smooth()
        values, shading_error = self._means(pixels)
        colors = np.divide(values, smooth.radiance, out=np.ones_like(values), where=smooth.radiance > 0)
        points.shading_error[chosen] = shading_error
        put(points.radiance, chosen, values)
        put(points.colors, chosen, colors)
        return sum(rays for _, rays in arriving)

    def _means(self, pixels: "PixelShading") -> tuple[Floats, Floats]:
        """Mean radiance (3, n), and its expected squared errors (n,).

        A first lattice, the larger the more texels a pixel covers, measures how many points it needs.
        """
        points = pixels.smooth
        across, along = points.footprints.swapaxes(0, 1)
        areas = np.abs(across[0] * along[1] - across[1] * along[0]) * self.texels[points.materials]
        least, share = FIRST_COARSE if self.error >= COARSE_ERROR else FIRST_FINE
        first = np.searchsorted(SIZES, np.clip(share * areas, least, MAX_FIRST))
        values, deviations = np.empty((3, points.count)), np.empty(points.count)
        pixels.shade(first, np.arange(points.count), values, deviations)
        needed = (deviations / (SINGLE_POINT_DEVIATION * 255 * self.error**2)) ** COUNT_EXPONENT
        levels = np.clip(np.searchsorted(SIZES, needed), first, SIZES.size - 1)
        pixels.shade(levels, np.flatnonzero(levels > first), values, np.empty(points.count))
        counts = SIZES[levels]
        return values, deviations**2 / counts ** np.where(areas > INCOHERENT_TEXELS, 1.0, VARIANCE_EXPONENT)


@dataclass(frozen=True, slots=True, eq=False)
class PixelShading:
    """Decoupled shading of n pixels.

    Attributes
    ----------
    smooth : Points
        Their centres, without maps.
    relief : (n,) bool
        Whether normal or bump maps change their normals.
    highlights : (3, n) float64
        Highlights of the centres without relief.
    maps : sequence of PointStage
    views : sequence of LightView
        Of each light from the centres.
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
        """Shade the centres without maps: diffuse terms into their radiance, the others into `highlights`."""
        shiny = copy(self.smooth)
        shiny.radiance = self.highlights
        for view, terms in zip(self.views, self.terms, strict=True):
            for term in terms if view.count else ():
                if term.adds == "diffuse":
                    term.run(view)
                elif not self.relief.all():
                    term.run(replace(view, points=shiny))

    def shade(self, levels: Integers, chosen: Integers, values: Floats, deviations: Floats) -> None:
        """Shade some pixels (m,) at the points of their lattices, `levels` (n,) in `SIZES`.

        Writes their means into `values` (3, n) and standard deviations of points into `deviations` (n,).
        """
        kinds = 2 * levels[chosen] + self.relief[chosen]
        for kind in np.unique(kinds).tolist():
            level, relief = divmod(kind, 2)
            alike, offsets = chosen[kinds == kind], lattice(int(SIZES[level]))
            radiance = self._bent if relief else self._colored
            step = max(BLOCK_POINTS // offsets.shape[1], 1)
            for start in range(0, alike.size, step):
                index = alike[start : start + step]
                means, deviations[index] = _moments(radiance(index, offsets))
                put(values, index, means)

    def _colored(self, index: Integers, offsets: Floats) -> Floats:
        """Radiance (K, 3, m) at points of some pixels (m,) on which colours vary and highlights do not."""
        points = TexturePoints(self.smooth, index, offsets)
        for stage in self.maps:
            if isinstance(stage, ColorTexture):
                stage.run(points)
        colors = points.colors.reshape(3, -1, index.size).swapaxes(0, 1)
        return colors * taken(self.smooth.radiance, index) + taken(self.highlights, index)

    def _bent(self, index: Integers, offsets: Floats) -> Floats:
        """Radiance (K, 3, m) at points of some pixels (m,) with a relief."""
        times = offsets.shape[1]
        points = TexturePoints(self.smooth, index, offsets)
        for stage in self.maps:
            stage.run(points)
        for view, terms in zip(self.views, self.terms, strict=True):
            repeated = view.repeated(points, index, times)
            for term in terms if repeated.count else ():
                term.run(repeated)
        return points.radiance.reshape(3, times, index.size).swapaxes(0, 1).copy()


def _moments(radiance: Floats) -> tuple[Floats, Floats]:
    """Means (3, m) over points, and standard deviations (m,) of their values clipped to white."""
    count = len(radiance)
    shown = np.minimum(radiance, 1)
    shown -= halving_sum(shown.copy()) / count
    deviations = np.sqrt(halving_sum(shown * shown).mean(axis=0) / count)
    return halving_sum(radiance) / count, deviations
