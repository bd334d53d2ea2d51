"""A plan of the renderer, with the textbooks' formulas in the places of its own."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

from benchmarks.textbook.factored import BareFlatShadows, BareRoundShadows
from benchmarks.textbook.hits import TextbookEllipsoids, TextbookRectangles, TextbookTriangles
from benchmarks.textbook.pairs import InSingle, SingleEmitter
from benchmarks.textbook.phong import TextbookDiffuse, TextbookHighlight
from benchmarks.textbook.shadows import FlatShadowRays, RoundShadowRays
from benchmarks.textbook.single import SINGLE, Singles, arguments, normalised, single
from benchmarks.textbook.trees import TextbookTree
from renderer.accelerators.intersection import TreeIntersector
from renderer.accelerators.raster import RasterIntersector
from renderer.cameras import Pinhole
from renderer.lights.surfaces import LightSurfaces
from renderer.materials.phong import Diffuse, Highlight
from renderer.plan.stages import Lighting
from renderer.shapes.ellipsoids import Ellipsoids
from renderer.shapes.family import Intersector, Location
from renderer.shapes.overlaps import Overlaps
from renderer.shapes.rectangles import Rectangles
from renderer.shapes.triangles import Triangles
from renderer.visibility.ellipsoids import EllipsoidShadows
from renderer.visibility.polygon_grids import GridPolygonShadows
from renderer.visibility.polygons import PolygonShadows

if TYPE_CHECKING:
    from collections.abc import Callable

    from renderer.interaction import RayStage
    from renderer.math.arrays import Floats, Integers
    from renderer.plan.plan import RenderPlan
    from renderer.plan.stages import LightStage, PointStage
    from renderer.shapes import Family

    ForLights = Callable[[LightStage], LightStage]


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class TextbookCamera(Pinhole):
    """The textbooks' pinhole: places of a virtual screen in the world, seen from the eye, in float32."""

    def rays(self, x: Floats, y: Floats, pixels: Integers, samples: Integers) -> tuple[Singles, Singles]:
        """Origin (3, 1) and unit directions (3, N) through raster positions (N,) and (N,)."""
        del pixels, samples
        across = (2 * x.astype(SINGLE) / self.width - 1) * self.half_width
        along = (1 - 2 * y.astype(SINGLE) / self.height) * self.half_height
        places = self.position + self.forward + self.right * across + self.up * along
        return self.position, normalised(places - self.position)


def textbook(plan: RenderPlan) -> RenderPlan:
    """The same picture by the formulas of the textbooks, in float32.

    Raises
    ------
    ValueError
        If the scene needs something that has no formula here.
    """
    return _with(plan, _pair_by_pair)


def factored(plan: RenderPlan) -> RenderPlan:
    """As `textbook`, with the work for each pair of point and light point factored as in the renderer."""
    return _with(plan, _factored)


def _with(plan: RenderPlan, for_lights: ForLights) -> RenderPlan:
    if plan.bent or plan.scattering:
        raise ValueError("no textbook formulas for smooth normals, normal maps, mirrors and glass.")
    return dataclasses.replace(
        plan,
        camera=TextbookCamera(**arguments(plan.camera)),
        intersectors=_for_rays(plan.intersectors),
        visible_lights=tuple(
            LightSurfaces(TextbookRectangles(**arguments(light.rectangles))) for light in plan.visible_lights
        ),
        surfaces=(InSingle(), *map(_for_points, plan.surfaces)),
        lightings=tuple(
            _lighting(light, for_lights) for light in plan.lightings if isinstance(light, Lighting)
        ),
    )


def _family(family: Family) -> Family:
    match family:
        case Triangles():
            return TextbookTriangles(**arguments(family))
        case Rectangles():
            return TextbookRectangles(**arguments(family))
        case Ellipsoids():
            return TextbookEllipsoids(**arguments(family))
    raise ValueError(f"no textbook formula for {family.plural}.")


def _for_rays(stages: tuple[RayStage, ...]) -> tuple[RayStage, ...]:
    """Without what mends hits where rounding chose between them: the textbooks have nothing for it."""
    return tuple(_met_by(stage) for stage in stages if not isinstance(stage, Overlaps))


def _met_by(stage: RayStage) -> RayStage:
    match stage:
        case Intersector():
            return dataclasses.replace(stage, family=_family(stage.family))
        case RasterIntersector():
            return _met_by(stage.tree)
        case TreeIntersector():
            return TextbookTree(**arguments(stage))
    raise ValueError(f"no textbook formula for {type(stage).__name__}.")


def _for_points(stage: PointStage) -> PointStage:
    if isinstance(stage, Location):
        return dataclasses.replace(stage, family=_family(stage.family))
    return single(stage)


def _lighting(light: Lighting, for_lights: ForLights) -> Lighting:
    return dataclasses.replace(
        light,
        emitter=SingleEmitter(**arguments(light.emitter)),
        shadows=tuple(map(for_lights, light.shadows)),
        terms=tuple(map(for_lights, light.terms)),
    )


def _pair_by_pair(stage: LightStage) -> LightStage:
    match stage:
        case PolygonShadows():
            return FlatShadowRays(single(stage.occluders), stage)
        case EllipsoidShadows():
            return RoundShadowRays(single(stage.family), stage)
        case Diffuse():
            return TextbookDiffuse(**arguments(stage))
        case Highlight():
            return TextbookHighlight(**arguments(stage))
    raise ValueError(f"no textbook formula for {type(stage).__name__}.")


def _factored(stage: LightStage) -> LightStage:
    match stage:
        case GridPolygonShadows():
            return BareFlatShadows(**arguments(stage))
        case EllipsoidShadows():
            return BareRoundShadows(**arguments(stage))
        case Diffuse() | Highlight():
            return single(stage)
    raise ValueError(f"{type(stage).__name__} has pair work that is not factored.")
