"""Registry of effects: the module of each part of the scene language, with the interface of plan building.

An incomplete kind is refused when it is registered, before any scene is read: a shape without a shadow caster
must not lead to pictures without shadows.
"""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel

import schemas.lights
import schemas.materials
import schemas.shapes
import schemas.textures
from renderer.accelerators.trees import in_tree, tree_of
from renderer.assets import AssetSource
from renderer.lights import emitters, falloff, spots
from renderer.lights.emitters import Emitter
from renderer.materials import phong
from renderer.materials.reflection import Term
from renderer.plan.stages import LightStage
from renderer.shapes import Family, ellipsoids, meshes, rectangles, triangles
from renderer.shapes.ellipsoids import Ellipsoids
from renderer.shapes.polygons import FlatFamily
from renderer.shapes.rectangles import Rectangles
from renderer.shapes.triangles import Triangles
from renderer.textures import Texture, checker, heights, mipmap
from renderer.textures.image import ImageTexture
from renderer.visibility.ellipsoids import EllipsoidShadows
from renderer.visibility.polygon_grids import GridPolygonShadows
from renderer.visibility.polygon_scatter import ScatterPolygonShadows
from renderer.visibility.segments import SegmentShadows
from renderer.visibility.trees import TreeShadows
from schemas.base import members

Color = tuple[float, float, float]

PairType = np.dtype[np.floating]

Occluder = Callable[[Any, Emitter, PairType, bool], list[LightStage]]
"""Takes a family, a light, the type of pair work and whether to cull."""


class Effect:
    """Base of the entries of the tables."""

    __slots__ = ()

    def disagreement(self, kind: type[BaseModel]) -> str | None:
        """Problem with the effect of a class of the scene language."""
        del kind
        return None


E = TypeVar("E", bound=Effect)


def cast_by_segments(family: Family, emitter: Emitter, dtype: PairType, culling: bool) -> list[LightStage]:
    """Shadows of any family, by intersecting rays with it."""
    del emitter, dtype, culling
    return [SegmentShadows(family)]


@dataclass(frozen=True, slots=True)
class ShapeEffect(Effect):
    """A kind of shape.

    Attributes
    ----------
    build : callable
        Makes the family of some shapes, given with their numbers and the scene's files.
    family : type of Family
        The family that it makes, whose methods describe its shapes.
    meshed : bool
        Whether one such shape may be so many primitives that shadow rays cost more than camera rays.
    cast : Occluder
        Makes the stages that mark the light points which such a family blocks; by default those that suit
        any family.
    """

    build: Callable[[Sequence[int], Sequence[Any], AssetSource], Family]
    family: type[Family]
    meshed: bool
    cast: Occluder = cast_by_segments

    def disagreement(self, kind: type[BaseModel]) -> str | None:
        """The methods that the family lacks."""
        del kind
        if not inspect.isabstract(self.family):
            return None
        return f"{self.family.__name__} does not define {_listed(self.family.__abstractmethods__)}"


@dataclass(frozen=True, slots=True)
class WeightEffect:
    """A weight of the points of a light.

    Attributes
    ----------
    name, detail : str
        As the plan lists it.
    field : str
        Field of the scene language that it comes from.
    asked : callable or None
        Whether a light asks for it; None if all of the kind do.
    build : callable
        Makes the stage of a light.
    """

    name: str
    detail: str
    field: str
    asked: Callable[[Any], bool] | None
    build: Callable[[Any], LightStage]


@dataclass(frozen=True, slots=True)
class LightEffect(Effect):
    """A kind of light.

    Attributes
    ----------
    build : callable
        Makes the emitter of a light, given with its number, its sampling and the seed.
    weights : tuple of WeightEffect
        Weights of its points; weights multiply.
    surface : bool
        Whether the camera may see it.
    """

    build: Callable[[int, Any, Any, int], Emitter]
    weights: tuple[WeightEffect, ...]
    surface: bool

    def disagreement(self, kind: type[BaseModel]) -> str | None:
        """A field that only one of scene language and renderer has."""
        served = {weight.field for weight in self.weights} | ({"visible"} if self.surface else set())
        for name in sorted({*served, "visible", "falloff", "outer_angle"}):
            if (name in served) != (name in kind.model_fields):
                parties = "renderer", "scene language"
                has, lacks = parties if name in served else parties[::-1]
                return f"the {has} has a '{name}' for it, and the {lacks} has none"
        return None


@dataclass(frozen=True, slots=True)
class MaterialEffect(Effect):
    """A kind of material: its reflection of lights. Everything else is common to all surfaces.

    Attributes
    ----------
    reflects : callable
        Whether a material reflects the light of any light.
    terms : callable
        Makes the terms of a light, given all materials that are shown and the type of pair work.
    brightest : callable
        Greatest radiance of a material in a channel, given the light's and the surface's colour.
    curvature : callable
        Bound of the second derivative of the reflected light by the angle to the light, per radian^2.
    """

    reflects: Callable[[Any], bool]
    terms: Callable[[Sequence[schemas.materials.Surface], PairType], list[Term]]
    brightest: Callable[[Any, float, float], float]
    curvature: Callable[[Any], float]

    def disagreement(self, kind: type[BaseModel]) -> str | None:
        """A class without the fields of all materials."""
        if issubclass(kind, schemas.materials.Surface):
            return None
        return "in the scene language it is no Surface, so it has no colour, maps and further rays"


@dataclass(frozen=True, slots=True)
class TextureEffect(Effect):
    """A kind of texture.

    Attributes
    ----------
    build : callable
        Makes the texture, given with the scene's files.
    brightest : callable
        Greatest value of each channel of a texture that was built.
    heights : callable or None
        Gives the image that bumps and displacement read; None if the scene language refuses heights of it.
    mean : callable or None
        Gives the texture of the scene language whose value is the exact mean over a footprint; None if
        there is none.
    single : callable or None
        Gives the colour that a texture of the scene language has everywhere, None if it has several; None
        if the scene does not say.
    """

    build: Callable[[Any, AssetSource], Texture]
    brightest: Callable[[Any], Color]
    heights: Callable[[Any], ImageTexture] | None
    mean: Callable[[Any], Any] | None
    single: Callable[[Any], Color | None] | None


def registered(union: Any, effects: Mapping[type[BaseModel], E]) -> dict[type[BaseModel], E]:
    """A table of effects, checked.

    Parameters
    ----------
    union
        The union of the scene language whose classes the table serves.
    effects
        An effect for each of them.

    Raises
    ------
    TypeError
        If a class of the union has no line in the table, or one that lacks something.
    """
    missing = [kind.__name__ for kind in members(union) if kind not in effects]
    if missing:
        raise TypeError(f"No effect is registered for {_listed(missing)}: add a line in {__name__}.")
    for kind, effect in effects.items():
        if wrong := effect.disagreement(kind):
            raise TypeError(f"{kind.__name__} cannot be registered: {wrong}.")
    return dict(effects)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(sorted(names))


def _brightest_texel(texture: ImageTexture | mipmap.MipmapTexture) -> Color:
    return (heights.image_of(texture).bounds[1],) * 3


def _brighter_field(texture: checker.CheckerTexture | checker.BoxCheckerTexture) -> Color:
    board = texture.board if isinstance(texture, checker.BoxCheckerTexture) else texture
    red, green, blue = np.maximum(board.even, board.odd)[:, 0].tolist()
    return red, green, blue


def _same_fields(texture: schemas.textures.CheckerTexture) -> Color | None:
    return texture.even if texture.even == texture.odd else None


def _boxed(texture: schemas.textures.CheckerTexture) -> schemas.textures.CheckerTexture:
    return texture.model_copy(update={"filter": "box"})


def cast_by_polygons(
    family: FlatFamily, emitter: Emitter, dtype: PairType, culling: bool
) -> list[LightStage]:
    """Shadows of few flat primitives, tested one by one."""
    kind = GridPolygonShadows if emitter.shared else ScatterPolygonShadows
    return [kind(family.occluders(), emitter, dtype, culling)]


def cast_by_triangles(
    family: Triangles, emitter: Emitter, dtype: PairType, culling: bool
) -> list[LightStage]:
    """Shadows of triangles: few are tested one by one, many through a tree."""
    if not in_tree(family):
        return cast_by_polygons(family, emitter, dtype, culling)
    return [TreeShadows(family, tree_of(family), emitter, dtype)]


def cast_by_ellipsoids(
    family: Ellipsoids, emitter: Emitter, dtype: PairType, culling: bool
) -> list[LightStage]:
    """Shadows of ellipsoids."""
    return [EllipsoidShadows(family, emitter, dtype, culling)]


_TRIANGLE = ShapeEffect(triangles.build, Triangles, meshed=False, cast=cast_by_triangles)
_RECTANGLE = ShapeEffect(rectangles.build, Rectangles, meshed=False, cast=cast_by_polygons)
_ELLIPSOID = ShapeEffect(ellipsoids.build, Ellipsoids, meshed=False, cast=cast_by_ellipsoids)
_MESH = ShapeEffect(meshes.build, Triangles, meshed=True, cast=cast_by_triangles)

SHAPES = registered(
    schemas.shapes.Shape,
    {
        schemas.shapes.Triangle: _TRIANGLE,
        schemas.shapes.Rectangle: _RECTANGLE,
        schemas.shapes.Parallelogram: _RECTANGLE,
        schemas.shapes.Ellipsoid: _ELLIPSOID,
        schemas.shapes.Sphere: _ELLIPSOID,
        schemas.shapes.Mesh: _MESH,
        schemas.shapes.MeshFile: _MESH,
    },
)


def _is_physical(light: Any) -> bool:
    return light.falloff == "physical"


_BY_FORM_FACTOR = WeightEffect(
    "falloff", "cosine and squared distance at light points", "falloff", _is_physical, falloff.build
)
_BY_DISTANCE = WeightEffect("falloff", "squared distance", "falloff", _is_physical, falloff.build)
_BY_CONE = WeightEffect("cone", "the angle from the axis", "outer_angle", None, spots.cone)

_AREA_LIGHT = LightEffect(emitters.build_rectangle, (_BY_FORM_FACTOR,), surface=True)

LIGHTS = registered(
    schemas.lights.Light,
    {
        schemas.lights.RectangleLight: _AREA_LIGHT,
        schemas.lights.ParallelogramLight: _AREA_LIGHT,
        schemas.lights.PointLight: LightEffect(emitters.build_point, (_BY_DISTANCE,), surface=False),
        schemas.lights.SpotLight: LightEffect(spots.build, (_BY_CONE, _BY_DISTANCE), surface=False),
        schemas.lights.DirectionalLight: LightEffect(emitters.build_directional, (), surface=False),
    },
)

MATERIALS = registered(
    schemas.materials.Material,
    {
        schemas.materials.PhongMaterial: MaterialEffect(
            phong.reflects, phong.terms, phong.brightest, phong.curvature
        ),
    },
)

TEXTURES = registered(
    schemas.textures.Texture,
    {
        schemas.textures.ImageTexture: TextureEffect(
            mipmap.build, _brightest_texel, heights.image_of, mean=None, single=None
        ),
        schemas.textures.CheckerTexture: TextureEffect(
            checker.build, _brighter_field, heights=None, mean=_boxed, single=_same_fields
        ),
    },
)


def occluder_of(family: Family) -> Occluder:
    """Shadow caster of a family."""
    return next(effect.cast for effect in SHAPES.values() if effect.family is type(family))
