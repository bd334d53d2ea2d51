"""Fine detail of surfaces, shaded at many places of a pixel with the light that its centre sees."""

from dataclasses import dataclass

import numpy as np

from renderer.adaptive.arrivals import Arrival, Beam
from renderer.interaction import Points
from renderer.lights.emitters import Emitter
from renderer.materials.reliefs import Base, Relief, Vectors, facing_viewer
from renderer.math.arrays import Floats, Integers, Masks, cross, dot, put, taken
from renderer.math.numerics import halving_sum
from renderer.plan.stages import Illumination
from renderer.shapes.frames import frame_of_normals
from renderer.textures.texels import Centers, Singles, TexelTable
from renderer.workspace import Workspace

LATTICES = {3: 2, 5: 3, 8: 5, 13: 8, 21: 13, 34: 21, 55: 34, 89: 55, 144: 89}
"""Places in a pixel, and the number that makes them a Fibonacci lattice (`levels.FIBONACCI`)."""

POWER = 0.8
"""Places are proportional to the deviation within the pixel to this power: the least work for a sum of
squared errors that fall like the number of places to the power -3 / 2."""

FALL = -1.7
"""Power of the number of places by which the squared error falls: between -3 / 2 of edges and -2."""

ALLOWED = 0.15, 0.8, 0.8
"""Deviation, in requested errors, of pixels that a single place is enough for: at least, at an error of 1/255
and in proportion to it, and at most. What is left at 0.25/255 must not call for samples: with 0.25 there, the
shadow of a ball on a relief takes several times as long. With 0.4 and 0.6 instead of 0.8, textures take
longer, and their errors are hardly smaller."""

SIZES = np.array(list(LATTICES))

COARSE = 1.5 / 255
"""For errors from this one on, fewer places show how many a pixel needs."""

FIRST_COARSE, FIRST_FINE, MOST_FIRST = (3, 0.25), (5, 1.0), 34
"""Places of the first lattice: at least, for each texel that a pixel covers, and at most. Fewer miss what is
thin, as 5 do at 4 x 4 texels a pixel."""

FAINTEST = 2.0**-16
"""Powers of highlights below this are left out."""

MOST_DEVIATION = 1 / 2
"""Largest standard deviation of values between black and white (Popoviciu 1935): that of pixels which cover
more texels than their places reach."""

TOGETHER = 16384
"""Places shaded at once: arrays stay in cache."""


def lattice(count: int) -> Singles:
    """Offsets (2, count, 1) from a pixel's centre, in sides of it: symmetric, so that slopes cancel."""
    index, turn = np.arange(count), LATTICES[count]
    along = (index - (count - 1) / 2) * turn / count + 0.5
    return np.stack(((index + 0.5) / count, along - np.floor(along)))[:, :, None].astype(
        np.float32
    ) - np.float32(0.5)


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """One light at n pixels, in frames of their own.

    Attributes
    ----------
    directions : (J, 3, n) float32
    weights : (J, n) float32
    sheens : (J, n) float32
        Cosines of directions and viewer.
    color : (3, 1) float32
    """

    directions: Singles
    weights: Singles
    sheens: Singles
    color: Singles


@dataclass(frozen=True, slots=True, eq=False)
class Detail:
    """A material whose colours or normals vary within pixels.

    Attributes
    ----------
    material : int
    color : (3, 1) float64
        Where no texture gives it.
    texels : TexelTable or None
        Of colours.
    relief : Relief or None
    ambient : (3, 1) float64
        Of what the surface reflects, whatever its normal.
    diffuse, specular, shininess : float
    error : float
        That the mean over a pixel may have.
    """

    material: int
    color: Floats
    texels: TexelTable | None
    relief: Relief | None
    ambient: Floats
    diffuse: float
    specular: float
    shininess: float
    error: float

    def shade(self, points: Points, lights: list[list[Beam]]) -> tuple[Floats, Floats, Floats]:
        """Shade pixels around points.

        Returns
        -------
        values, reflectances : (3, n) float64
            Means over the pixels.
        doubts : (n,) float64
            Squared errors to expect of the radiance.
        """
        base = _upright(points) if self.relief is None else self.relief.base(points)
        centers = None
        if self.texels is not None:
            centers = self.texels.centers(points.coordinates, points.footprints)
        viewers = _local(base, points.viewers)
        arriving = [self._light(base, viewers, beams) for beams in lights if beams]
        values = np.empty((3, points.count))
        pixels = Pixels(centers, base, viewers, arriving)
        deviations, levels = self._sampled(pixels, values)
        light = self._arriving(points.shading_normals, lights)
        reflectances = np.divide(values, light, out=np.ones_like(values), where=light > 0)
        unseen = MOST_DEVIATION**2 * (np.minimum(light, 1) ** 2).mean(axis=0)
        doubts = np.where(pixels.cut(), unseen, deviations**2 * SIZES[levels] ** FALL)
        return values, reflectances, doubts

    def _arriving(self, normals: Floats, lights: list[list[Beam]]) -> Floats:
        """What white of the same kind would reflect, (3, n), without highlights."""
        light = np.broadcast_to(self.ambient, normals.shape).copy()
        for beams in lights:
            for beam in beams:
                share = self.diffuse * beam.weights * np.maximum(dot(beam.directions, normals), 0)
                light += beam.color * share
        return light

    def _sampled(self, pixels: "Pixels", values: Floats) -> tuple[Floats, Integers]:
        """Put mean radiance into `values` (3, n); gives deviations in the pixels and their lattices, (n,).

        A first lattice, the larger the more texels a pixel covers, finds out how many places it needs.
        """
        least, share = FIRST_COARSE if self.error >= COARSE else FIRST_FINE
        places = np.clip(share * pixels.areas(), least, MOST_FIRST)
        first = np.searchsorted(SIZES, places)
        deviations = np.empty(first.size)
        for level in np.unique(first).tolist():
            chosen = np.flatnonzero(first == level)
            deviations[chosen] = self._means(pixels, chosen, int(SIZES[level]), values)
        least_allowed, usual, most = ALLOWED
        allowed = np.clip(usual * 255 * self.error, least_allowed, most)
        needed = (deviations / (allowed * self.error)) ** POWER
        levels = np.clip(np.searchsorted(SIZES, needed), first, SIZES.size - 1)
        for level in np.unique(levels[levels > first]).tolist():
            chosen = np.flatnonzero((levels == level) & (first < level))
            self._means(pixels, chosen, int(SIZES[level]), values)
        return deviations, levels

    def _light(self, base: Base, viewers: Singles, beams: list[Beam]) -> Light:
        directions = np.stack([_local(base, beam.directions) for beam in beams])
        return Light(
            directions,
            np.stack([beam.weights for beam in beams]).astype(np.float32),
            (directions * viewers).sum(axis=1),
            beams[0].color.astype(np.float32),
        )

    def _means(self, pixels: "Pixels", chosen: Integers, size: int, values: Floats) -> Floats:
        """Put means over lattices into `values` (3, n); gives standard deviations (m,) of single places."""
        offsets = lattice(size)
        deviations = np.empty(chosen.size)
        step = max(TOGETHER // size, 1)
        for start in range(0, chosen.size, step):
            index = chosen[start : start + step]
            found = self._radiance(pixels.part(index), offsets)
            means = [halving_sum(part.copy()) / np.float32(size) for part in found]
            put(values, index, np.stack(means))
            deviations[start : start + step] = _deviations(found)
        return deviations

    def _radiance(self, pixels: "Pixels", offsets: Singles) -> Vectors:
        """Radiance at places of pixels, (K, n) for each channel."""
        if self.relief is None:
            normals, cosines = _straight(pixels.viewers)
        else:
            normals, cosines = facing_viewer(self.relief.normals(pixels.base, offsets), pixels.viewers)
        lit = [(light.color, *self._lit(light, normals, cosines)) for light in pixels.lights]
        shape = offsets.shape[1], pixels.viewers.shape[1]
        found = []
        for channel, color in enumerate(self._colors(pixels, offsets)):
            value = np.full(shape, self.ambient[channel], dtype=np.float32)
            for light, cosine, _ in lit:
                value += cosine * (light[channel] * np.float32(self.diffuse))
            value *= color
            for light, _, highlight in lit:
                value += highlight * (light[channel] * np.float32(self.specular))
            found.append(value)
        return found

    def _colors(self, pixels: "Pixels", offsets: Singles) -> list[Singles]:
        """Colours at places of pixels, (K, n) or (1, 1) for each channel."""
        if self.texels is None or pixels.centers is None:
            return list(self.color[:, :, None].astype(np.float32))
        return self.texels.at(pixels.centers, offsets, 3)

    def _lit(self, light: Light, normals: Vectors, cosines: Singles) -> tuple[Singles, Singles]:
        """Sums over a light's directions of cosines, and of the powers of highlights."""
        least = np.float32(max(FAINTEST ** (1 / max(self.shininess, 2.0**-10)), 2.0**-100))
        twice = 2 * cosines
        lit, highlight = np.zeros_like(twice), np.zeros_like(twice)
        for direction, weights, sheens in zip(light.directions, light.weights, light.sheens, strict=True):
            cosine = normals[0] * direction[0]
            cosine += normals[1] * direction[1]
            cosine += normals[2] * direction[2]
            np.maximum(cosine, 0, out=cosine)
            if self.specular:
                mirrored = cosine * twice
                mirrored -= sheens
                mirrored *= cosine > 0
                seen = mirrored >= least
                # Most blocks of pixels see no highlight, and powers are most of the work.
                if seen.any():
                    np.clip(mirrored, least, 1, out=mirrored)
                    np.power(mirrored, np.float32(self.shininess), out=mirrored)
                    mirrored *= seen
                    mirrored *= weights
                    highlight += mirrored
            cosine *= weights
            lit += cosine
        return lit, highlight


@dataclass(frozen=True, slots=True, eq=False)
class Pixels:
    """All that shading needs of n pixels."""

    centers: Centers | None
    base: Base
    viewers: Singles
    lights: list[Light]

    def cut(self) -> Masks:
        """Whether a pixel covers more of some table than its places reach, (n,)."""
        cut: Masks = np.logical_or.reduce([each.cut for each in self._tables()])
        return cut

    def areas(self) -> Floats:
        """Texels that each pixel covers, (n,), on the table where they are most."""
        sides = [each.sides.astype(np.float64) for each in self._tables()]
        found: Floats = np.max(
            [np.abs(a[0] * b[1] - b[0] * a[1]) for a, b in (s.swapaxes(0, 1) for s in sides)], axis=0
        )
        return found

    def _tables(self) -> list[Centers]:
        return [*self.base.centers, *([] if self.centers is None else [self.centers])]

    def part(self, index: Integers) -> "Pixels":
        """Some of them (m,)."""
        return Pixels(
            None if self.centers is None else self.centers.part(index),
            self.base.part(index),
            taken(self.viewers, index),
            [
                Light(
                    taken(each.directions, index),
                    taken(each.weights, index),
                    taken(each.sheens, index),
                    each.color,
                )
                for each in self.lights
            ],
        )


@dataclass(frozen=True, slots=True, eq=False)
class DetailedLights:
    """All lights of a plan, at hits whose materials are shaded apart from light.

    Attributes
    ----------
    plain : tuple of Illumination
        The lights for all other materials.
    arrivals : tuple of Arrival
    details : tuple of Detail
    used : (materials,) bool
        Materials with a detail.
    """

    plain: tuple[Illumination, ...]
    arrivals: tuple[Arrival, ...]
    details: tuple[Detail, ...]
    used: Masks

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
        detailed = self.used[points.materials]
        rays = 0
        if not detailed.all():
            chosen = np.flatnonzero(~detailed)
            part = points.part(chosen)
            rays += sum(light.run(part, workspace) for light in self.plain)
            put(points.radiance, chosen, part.radiance)
        for detail in self.details:
            chosen = np.flatnonzero(points.materials == detail.material)
            if chosen.size:
                rays += self._shade(detail, points, chosen, workspace)
        return rays

    def _shade(self, detail: Detail, points: Points, chosen: Integers, workspace: Workspace) -> int:
        part = points.part(chosen)
        arriving = [arrival.run(part, workspace) for arrival in self.arrivals]
        values, colors, doubts = detail.shade(part, [list(beams) for beams, _ in arriving])
        points.doubts[chosen] = doubts
        put(points.radiance, chosen, values)
        put(points.colors, chosen, colors)
        return sum(rays for _, rays in arriving)


def _upright(points: Points) -> Base:
    """Frames of plain surfaces: any axes across the normal do."""
    normals = points.shading_normals
    first = frame_of_normals(normals)
    second = cross(normals, first)
    return Base((first, second, normals), (), np.empty((0, points.count), dtype=np.float32))


def _local(base: Base, vectors: Floats) -> Singles:
    """Components of vectors (3, n) along the axes."""
    return np.stack([dot(axis, vectors) for axis in base.axes]).astype(np.float32)


def _straight(viewers: Singles) -> tuple[Vectors, Singles]:
    """Normals of plain surfaces, one for all, and their cosines with the viewers (3, n), (1, n)."""
    across, upright = np.zeros((1, 1), dtype=np.float32), np.ones((1, 1), dtype=np.float32)
    return [across, across, upright], viewers[2][None]


def _deviations(found: Vectors) -> Floats:
    """Standard deviation (n,) of what places of a pixel show, clipped to white, mean over channels."""
    squares = np.zeros(found[0].shape[1])
    for part in found:
        shown = np.minimum(part, 1)
        shown -= halving_sum(shown.copy()) / np.float32(len(shown))
        squares += halving_sum(shown * shown) / len(shown)
    return np.sqrt(squares / 3)
