"""Phong's model: diffuse and highlight terms, each a stage that only runs where it is requested.

What a light adds is the mean over its points of V * light * (diffuse * color * max(0, n . l) +
specular * max(0, r . v)^shininess) with r = 2 (n . l) n - l, where a light point with n . l <= 0 gives
nothing. r . v = l . w with w = 2 (n . v) n - v: one vector a point, not a pair.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from renderer.lights.view import LightView
from renderer.materials.reflection import Term
from renderer.math.arrays import Floats, Masks, Pairs, add, dot, taken
from schemas.materials import PhongMaterial, Surface

MAX_FLOAT32_EXPONENT = 128.0
"""Highlights with a larger exponent are computed in float64: the rounding of a float32 cosine would be
visible."""

MIN_POWER = 2.0**-40
"""Smaller powers of cosines are invisible and replaced by 0: zeros and results near the smallest number make
`np.power` leave its vectorized path, which is several times as fast."""

LEAST_EXPONENT = float(np.finfo(np.float32).tiny)
"""Replaces an exponent of 0, so that every cosine but 0 gives 1."""


@dataclass(frozen=True, slots=True, eq=False)
class Phong:
    """Parameters of K materials as arrays; 0 for those of other kinds.

    Attributes
    ----------
    diffuse, specular, shininess : (K,) float64
    """

    diffuse: Floats
    specular: Floats
    shininess: Floats

    def faintest(self) -> Floats:
        """Cosines (K,) whose power is `MIN_POWER`; that of the exponent 0 is the smallest normal number."""
        tiny = float(np.finfo(np.float32).tiny)
        return np.maximum(MIN_POWER ** (1 / np.maximum(self.shininess, tiny)), tiny)


def build(materials: Sequence[Surface]) -> Phong:
    """Tables of the materials in the order given."""

    def numbers(name: str) -> Floats:
        found = [getattr(each, name) if isinstance(each, PhongMaterial) else 0.0 for each in materials]
        return np.array(found, dtype=np.float64)

    return Phong(numbers("diffuse"), numbers("specular"), numbers("shininess"))


def terms(materials: Sequence[Surface], dtype: np.dtype[np.floating]) -> list[Term]:
    """Terms of a light for K materials, with pair work in `dtype`."""
    table = build(materials)
    found = []
    if table.diffuse.any():
        found.append(Term(Diffuse(table), "diffuse term", "cosines at light points", table.diffuse > 0, 1.0))
    double = np.dtype(np.float64)
    for above, upto, precision in (
        (-1.0, MAX_FLOAT32_EXPONENT, dtype),
        (MAX_FLOAT32_EXPONENT, np.inf, double),
    ):
        shiny = (table.specular > 0) & (table.shininess > above) & (table.shininess <= upto)
        if shiny.any():
            stage, detail = Highlight(table, above, upto, precision), f"cosines to powers, {precision}"
            found.append(Term(stage, "highlights", detail, shiny, float(shiny.mean()), viewed=True))
    return found


def reflects(material: PhongMaterial) -> bool:
    """Whether a material reflects the light of any light."""
    return bool(material.diffuse or material.specular)


def brightest(material: PhongMaterial, light: float, color: float) -> float:
    """Greatest radiance in a channel, all cosines taken as 1."""
    return light * (material.diffuse * color + material.specular)


def curvature(material: PhongMaterial) -> float:
    """Second derivative of the reflected light by the angle to the light, per radian^2, as a rough bound."""
    return 2.0 + 2.0 * material.specular * material.shininess


@dataclass(frozen=True, slots=True)
class Diffuse:
    """Stage of a light: Lambert's cosine."""

    adds: ClassVar[Literal["diffuse"]] = "diffuse"
    phong: Phong

    def run(self, view: LightView) -> None:
        """Add the mean over light points of V * light * diffuse * color * max(0, n . l)."""
        points, chosen = view.points, view.chosen
        cosines = view.cosines(view.of_points(points.shading_normals), view.pairs("cosines"))
        share = view.mean(cosines) * self.phong.diffuse[view.of_points(points.materials)]
        add(points.radiance, chosen, view.emitter.color * view.of_points(points.colors) * share)


@dataclass(frozen=True, slots=True)
class Highlight:
    """Stage of a light: the highlight of the materials whose exponent lies in (`above`, `upto`]."""

    adds: ClassVar[Literal["specular"]] = "specular"
    phong: Phong
    above: float
    upto: float
    dtype: np.dtype[np.floating]

    def run(self, view: LightView) -> None:
        """Add the mean over light points of V * light * specular * max(0, r . v)^shininess."""
        materials = view.of_points(view.points.materials)
        exponents, faintest = self.phong.shininess[materials], self.phong.faintest()[materials]
        shiny = (self.phong.specular[materials] > 0) & (exponents > self.above) & (exponents <= self.upto)
        mirror = _mirror(view)
        index = np.flatnonzero(shiny & _shows(view, mirror, faintest))
        if not index.size:
            return
        part = view.part(index, self.dtype)
        normals = part.of_points(part.points.shading_normals)
        values = part.cosines(taken(mirror, index), part.pairs("highlights"))
        _powers(values, exponents[index], faintest[index])
        lit = part.positive_cosines(normals)
        if lit is not None:
            np.multiply(values, lit, out=values)
        share = part.mean(values) * self.phong.specular[materials[index]]
        add(part.points.radiance, part.chosen, view.emitter.color * share)


def _mirror(view: LightView) -> Floats:
    """The viewer's direction mirrored at the shading normal, (3, n)."""
    normals, viewers = view.of_points(view.points.shading_normals), view.of_points(view.points.viewers)
    return 2 * dot(normals, viewers) * normals - viewers


def _shows(view: LightView, mirror: Floats, faintest: Floats) -> Masks:
    """Points (n,) that may get more than the faintest highlight from some point of the light."""
    emitter = view.emitter
    extent = np.abs(dot(mirror, emitter.first)) + np.abs(dot(mirror, emitter.second))
    nearest = np.maximum(view.distances() - emitter.extent / 2, 0)
    # Wider by 64 roundings of float32: pair work decides near the border.
    return dot(mirror, view.towards) + extent / 2 > faintest * nearest - (nearest + extent) * 2.0**-18


def _powers(cosines: Pairs, exponents: Floats, faintest: Floats) -> None:
    """Cosines ** exponents in place, (L, n) and (n,), and 0 below cosines `faintest` (n,).

    So 0 ** 0 = 0: no highlight where r . v <= 0.
    """
    least = faintest.astype(cosines.dtype)
    seen = cosines >= least
    np.clip(cosines, least, 1, out=cosines)
    np.power(cosines, exponents.astype(cosines.dtype), out=cosines)
    np.multiply(cosines, seen, out=cosines)
