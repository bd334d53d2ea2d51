"""Which materials are shaded all over pixels, apart from light: those on which only textures vary fast."""

from dataclasses import replace

import numpy as np

import schemas.textures as language
from renderer.adaptive.arrivals import AreaArrival, Arrival, PointArrival, side_for, with_nodes
from renderer.adaptive.details import Detail, DetailedLights
from renderer.adaptive.lighting import PilotLighting
from renderer.materials.reliefs import BumpRelief, MappedRelief, Relief
from renderer.math.arrays import column
from renderer.plan.request import Request
from renderer.plan.stages import Illumination, Lighting
from renderer.textures.image import ImageTexture
from renderer.textures.texels import TexelTable, slopes, table
from schemas.materials import PhongMaterial, Surface
from schemas.quality import TargetQuality

DENSER, MOST_POINTS = 4, 1024
"""Light points in penumbrae on such materials, times those on others, and how many at most: sampled camera
rays that hit fine detail as well cost far more."""


def materials(request: Request, lightings: tuple[Illumination, ...]) -> frozenset[str]:
    """Materials that are shaded in detail; none where no light shines."""
    if not lightings:
        return frozenset()
    return frozenset(name for name in request.names if _eligible(request, request.document.materials[name]))


def _eligible(request: Request, material: Surface) -> bool:
    """Whether images are all that varies on a material of Phong's model within pixels.

    Reflections and refractions vary as well. A bump map on top of a normal map, or one that turns over from
    copy to copy, has no slopes that a table could hold.
    """
    bumped, mapped = material.bump_map, material.normal_map
    names = [name for name in (material.color_texture, mapped, bumped) if name is not None]
    textures = [request.document.textures[name] for name in names]
    sampled = material.mirror or material.transmission or not isinstance(material, PhongMaterial)
    if not names or sampled or (bumped and mapped):
        return False
    if bumped is not None:
        bump = request.document.textures[bumped]
        if not isinstance(bump, language.ImageTexture) or bump.filter != "bilinear" or bump.wrap == "mirror":
            return False
    return all(isinstance(each, language.ImageTexture) and each.filter != "mipmap" for each in textures)


def lightings(
    request: Request, target: TargetQuality, plain: tuple[Illumination, ...]
) -> tuple[Illumination, ...]:
    """The lights of pilot samples, all in one where some material is shaded apart from them."""
    if not request.details:
        return plain
    shining = [m for m in map(request.document.materials.get, request.details) if m and m.specular]
    side = side_for(target.error, max((material.shininess for material in shining), default=0.0))
    return (
        DetailedLights(
            plain=plain,
            arrivals=tuple(_arrival(light, side) for light in plain),
            details=tuple(
                _detail(request, number, name, target.error)
                for number, name in enumerate(request.names)
                if name in request.details
            ),
            used=np.array([name in request.details for name in request.names]),
        ),
    )


def _arrival(light: Illumination, side: int) -> Arrival:
    """A light as its beams, `side` along each side of it if it has an area."""
    if isinstance(light, PilotLighting):
        nodes, partial = with_nodes(light.emitter, side), light.partial
        count = min(DENSER * partial.emitter.count, MOST_POINTS)
        many = replace(partial, emitter=replace(partial.emitter, count=count))
        return AreaArrival(light.probe, many, nodes, replace(partial, emitter=nodes, shadows=(), terms=()))
    assert isinstance(light, Lighting)
    return PointArrival(replace(light, terms=()))


def _detail(request: Request, number: int, name: str, error: float) -> Detail:
    material = request.document.materials[name]
    texels = None if material.color_texture is None else _table(request, material.color_texture, stored=False)
    return Detail(
        material=number,
        color=column(material.color if material.color is not None else (1.0, 1.0, 1.0)),
        texels=texels,
        relief=_relief(request, material),
        ambient=column(request.document.ambient) * material.ambient,
        diffuse=material.diffuse,
        specular=material.specular,
        shininess=material.shininess,
        error=error,
    )


def _table(request: Request, name: str, *, stored: bool) -> TexelTable:
    texture = request.texture(name, stored=stored)
    assert isinstance(texture, ImageTexture)
    texels = 2 * texture.texels - 1 if stored else texture.texels
    return table(texels, texture.wrap, nearest=texture.filter == "nearest")


def _relief(request: Request, material: Surface) -> Relief | None:
    if material.normal_map is not None:
        return MappedRelief(_table(request, material.normal_map, stored=True))
    if material.bump_map is not None:
        heights = request.heights(material.bump_map, material.bump_height)
        texels = heights.texture.texels.astype(np.float64)
        return BumpRelief(*slopes(heights.scale * texels.mean(axis=2), heights.texture.wrap))
    return None
