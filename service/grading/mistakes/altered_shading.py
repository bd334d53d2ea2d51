"""Mistakes in shading, made by plans whose stages compute something else than Phong's model asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar, Literal

import numpy as np

from renderer.interaction import Points, Viewers
from renderer.lights.emitters import Emitter
from renderer.lights.view import LightView
from renderer.materials.phong import Diffuse, Highlight, Phong
from renderer.math.arrays import Floats, add, dot
from renderer.plan.building import compile_visibility
from renderer.plan.effects import MATERIALS
from renderer.plan.plan import RenderPlan
from renderer.plan.stages import Illumination, Lighting
from renderer.workspace import Workspace
from schemas.lights import DirectionalLight
from schemas.scene import Scene
from schemas.shapes import Ellipsoid, Parallelogram, Rectangle, Triangle
from service.grading.mistakes.altered_rays import Change

BRIGHTEST = 1e6
"""Wrong formulas may overflow; brighter values are white in any picture."""

MAPS = ("normal_map", "bump_map", "displacement_map")
"""Fields of a material whose normals no formula for the whole shape gives."""


Bend = Callable[[Any, Floats, Floats], Floats]
"""Maps a shape, and the positions and normals (N, 3) of its hits, to other normals."""


Shine = Callable[[Lighting, Points, Workspace], int]
"""Changes the radiance of points by a light, and gives the number of shadow rays."""


@dataclass(frozen=True, slots=True)
class Formula:
    """A variant of Phong's formula; each field that differs from its default is a mistake.

    Attributes
    ----------
    unit_light : bool
        Whether the vector to the light is normalised.
    halfway : bool
        Whether highlights are (n . h) to the shininess.
    colored : bool
        Whether highlights have the colour of the surface.
    clamped : bool
        Whether r . v below 0 counts as 0.
    """

    unit_light: bool = True
    halfway: bool = False
    colored: bool = False
    clamped: bool = True


def bent(bend: Bend, document: Scene, shapes: Any, places: Floats, normals: Floats) -> Floats:
    """Wrong normals of hits with the shapes of these numbers, (N, 3), on the same side as the right ones."""
    changed = normals.copy()
    for number, shape in enumerate(document.shapes):
        seen = np.flatnonzero(shapes == number)
        if seen.size:
            changed[seen] = bend(shape, places[seen], normals[seen])
    turned = (changed * normals).sum(axis=1, keepdims=True) < 0
    return np.where(turned, -changed, changed)


def from_center(shape: Any, places: Floats, normals: Floats) -> Floats:
    """Not normalised: p - center on an ellipsoid, the cross product of the edges on a flat shape."""
    return places - np.array(shape.center) if shape.type == "ellipsoid" else normals * _area(shape)


def of_gradient(shape: Any, places: Floats, normals: Floats) -> Floats:
    """Not normalised: M^-T x for x on the unit sphere, the cross product of the edges on a flat shape."""
    if shape.type != "ellipsoid":
        return normals * _area(shape)
    axes = np.array(shape.axes) if isinstance(shape, Ellipsoid) else np.eye(3) * shape.radius
    inverse = np.linalg.inv(axes.T)
    gradient: Floats = (places - np.array(shape.center)) @ inverse.T @ inverse
    return gradient


def of_sphere(shape: Any, places: Floats, normals: Floats) -> Floats:
    """Of unit length, but along p - center on an ellipsoid."""
    if shape.type != "ellipsoid":
        return normals
    away = places - np.array(shape.center)
    return np.asarray(away / np.linalg.norm(away, axis=1, keepdims=True))


def _area(shape: Triangle | Rectangle | Parallelogram) -> float:
    """Length of the cross product of the two edges."""
    if isinstance(shape, Rectangle):
        return shape.size[0] * shape.size[1]
    if isinstance(shape, Parallelogram):
        return float(np.linalg.norm(np.cross(*shape.edges)))
    a, b, c = np.array(shape.vertices)
    return float(np.linalg.norm(np.cross(b - a, c - a)))


RIGHT = Formula()

FORMULAS = (
    ("halfway_vector", Formula(halfway=True)),
    ("light_not_normalised", Formula(unit_light=False)),
    ("highlight_colored", Formula(colored=True)),
    ("highlight_not_clamped", Formula(clamped=False)),
)
NORMALS = (
    ("normals_not_normalised", from_center),
    ("normals_not_normalised", of_gradient),
    ("normals_of_spheres", of_sphere),
)


def altered_shading(document: Scene) -> Iterator[tuple[str, Change]]:
    """Causes, and the changes of plans that make these mistakes."""
    if not is_lit(document):
        return
    yield "shadows_missing", without_shadows
    yield "normals_flipped", partial(_with_altered_lights, _from_behind)
    yield "cosine_not_clamped", partial(_with_altered_lights, partial(_subtracted, shadowed=True))
    yield "cosine_not_clamped", partial(_with_altered_lights, partial(_subtracted, shadowed=False))
    shiny = any(getattr(material, "specular", 0) for material in document.materials.values())
    for cause, formula in FORMULAS:
        if shiny or not formula.unit_light:
            yield cause, partial(_with_formula, formula)
    if _is_plain(document):
        for cause, bend in NORMALS:
            yield cause, partial(_with_normals, bend)


def is_lit(document: Scene) -> bool:
    """Whether some light reaches a material that reflects it."""
    shown = {shape.material for shape in document.shapes}
    materials = [document.materials[name] for name in shown]
    return bool(document.lights) and any(MATERIALS[type(m)].reflects(m) for m in materials)


def _is_plain(document: Scene) -> bool:
    """Whether the normals of all shapes follow from their form alone."""
    return not any(
        getattr(material, name) for material in document.materials.values() for name in MAPS
    ) and all(
        shape.type in ("rectangle", "ellipsoid") or (isinstance(shape, Triangle) and shape.normals is None)
        for shape in document.shapes
    )


def without_shadows(plan: RenderPlan) -> RenderPlan:
    """The plan of a program that casts no shadow rays."""
    return _with_lights(lambda light: replace(light, shadows=()), plan)


def _with_lights(change: Callable[[Lighting], Illumination], plan: RenderPlan) -> RenderPlan:
    lights = tuple(change(light) if isinstance(light, Lighting) else light for light in plan.lightings)
    return replace(plan, lightings=lights)


def _with_altered_lights(add: Shine, plan: RenderPlan) -> RenderPlan:
    """The plan with altered lights, none of which lacks shadows: a lone round shape is dark inside."""
    shadows = {light.emitter.number: light.shadows for light in compile_visibility(plan)}
    return _with_lights(
        lambda light: AlteredLight(replace(light, shadows=shadows[light.emitter.number]), add), plan
    )


@dataclass(frozen=True, slots=True)
class AlteredLight:
    """A light that does something else than the `right` one, which has all its shadows."""

    right: Lighting
    add: Shine

    @property
    def emitter(self) -> Emitter:
        """The light."""
        return self.right.emitter

    @property
    def casts(self) -> bool:
        """Whether anything can stand in its way."""
        return self.right.casts

    def run(self, points: Points, workspace: Workspace) -> int:
        """Change the points' radiance; gives the number of shadow rays."""
        return self.add(self.right, points, workspace)


def _from_behind(light: Lighting, points: Points, workspace: Workspace) -> int:
    """Light the side of surfaces that the viewer does not see."""
    return light.run(_turned(points), workspace)


def _subtracted(light: Lighting, points: Points, workspace: Workspace, *, shadowed: bool) -> int:
    """Add the light, and subtract the diffuse term of the other side, as if n . l counted below 0.

    Where the loss is `shadowed` too, a round shape shadows its own dark side.
    """
    matt = tuple(term for term in light.terms if term.adds == "diffuse")
    behind = _turned(points)
    behind.radiance = np.zeros_like(points.radiance)
    rays = light.run(points, workspace)
    rays += replace(light, terms=matt, shadows=light.shadows if shadowed else ()).run(behind, workspace)
    points.radiance -= behind.radiance
    return rays


def _turned(points: Points) -> Points:
    """The same points as if their rays had come from the other side; the radiance is shared."""
    behind = copy(points)
    behind.normals, behind.flipped = -points.normals, ~points.flipped
    behind.shading_normals = -points.shading_normals
    return behind


def _with_formula(formula: Formula, plan: RenderPlan) -> RenderPlan:
    def change(light: Lighting) -> Lighting:
        length = _length(plan.document, light.emitter)
        tables = [term.phong for term in light.terms if isinstance(term, Diffuse | Highlight)]
        kept = [term for term in light.terms if not isinstance(term, Diffuse | Highlight)]
        altered = [AlteredPhong(table, formula, length) for table in tables[:1]]
        return replace(light, terms=(*kept, *altered))

    return _with_lights(change, replace(plan, surfaces=(*plan.surfaces, Viewers())))


def _length(document: Scene, emitter: Emitter) -> float:
    """Length of a directional light's vector, which the renderer normalises; 1 for other lights."""
    light = document.lights[emitter.number]
    return float(np.linalg.norm(light.direction)) if isinstance(light, DirectionalLight) else 1.0


def _with_normals(bend: Bend, plan: RenderPlan) -> RenderPlan:
    # The renderer's own highlights take no cosine above 1, which long normals give.
    return _with_formula(RIGHT, replace(plan, surfaces=(*plan.surfaces, BentNormals(plan.document, bend))))


@dataclass(frozen=True, slots=True, eq=False)
class BentNormals:
    """Stage: shading normals of another direction or length."""

    document: Scene
    bend: Bend

    def run(self, points: Points) -> None:
        """Replace the shading normals."""
        wrong = bent(self.bend, self.document, points.shapes, points.positions.T, points.normals.T)
        points.shading_normals, points.bent = np.ascontiguousarray(wrong.T), True


@dataclass(frozen=True, slots=True)
class AlteredPhong:
    """Stage of a light: the diffuse and highlight terms by another formula."""

    adds: ClassVar[Literal["diffuse"]] = "diffuse"
    phong: Phong
    formula: Formula
    length: float

    def run(self, view: LightView) -> None:
        """Add both terms."""
        points, chosen = view.points, view.chosen
        materials, colors = view.of_points(points.materials), view.of_points(points.colors)
        cosines, gloss = self._cosines(view)
        powers = _powers(gloss, self.phong.shininess[materials], clamped=self.formula.clamped)
        high = view.mean(np.where(cosines > 0, powers, 0)) * self.phong.specular[materials]
        matt = view.mean(np.maximum(cosines, 0)) * self.phong.diffuse[materials]
        tint = colors if self.formula.colored else np.ones_like(colors)
        add(points.radiance, chosen, view.emitter.color * (matt * colors + high * tint))

    def _cosines(self, view: LightView) -> tuple[Floats, Floats]:
        """The numbers n . l and r . v, or n . h for the latter, (L, n) each."""
        normals, viewers = view.of_points(view.points.shading_normals), view.of_points(view.points.viewers)
        level = dot(normals, viewers)
        scales = self.length / view.scale() if not self.formula.unit_light else view.inverse_distances()
        cosines = _affine(view, normals) * scales
        if self.formula.halfway:
            along = _affine(view, viewers) * scales
            return cosines, (cosines + level) / np.sqrt(np.maximum(2 + 2 * along, np.finfo(float).tiny))
        return cosines, _affine(view, 2 * level * normals - viewers) * scales


def _affine(view: LightView, vectors: Floats) -> Floats:
    """M . (q - p) in the points' own scale, (L, n)."""
    found = np.empty((view.light_points.count, view.count))
    view.light_points.affine(view.terms(vectors), found, view.workspace)
    return found


def _powers(gloss: Floats, exponents: Floats, *, clamped: bool) -> Floats:
    """Powers (L, n); numbers below 0 have one if they count and the exponent is a whole number."""
    base = np.maximum(gloss, 0)
    if not clamped:
        base = np.where(exponents % 1 == 0, np.where(exponents == 0, np.abs(gloss), gloss), base)
    with np.errstate(over="ignore"):
        powers = np.power(base, np.maximum(exponents, np.finfo(float).tiny))
    bounded: Floats = np.clip(powers, -BRIGHTEST, BRIGHTEST)
    return bounded
