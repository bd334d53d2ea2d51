"""Surface stages of hit points: colours, normals, ambient light."""

import numpy as np

from renderer.cameras import build_pinhole
from renderer.materials.maps import Ambient, BumpMap, Colors, ColorTexture, Horizon, NormalMap, TangentFrames
from renderer.math.arrays import Floats, Integers, Masks, column, columns
from renderer.plan.cost import COSTS
from renderer.plan.request import Request
from renderer.plan.stages import PointStage
from renderer.textures import Texture
from renderer.textures import footprints as footprint_stage
from renderer.textures.footprints import Footprints
from renderer.textures.heights import LOOKUPS_A_SLOPE
from schemas.pointers import escaped
from schemas.scene import used_textures

AVERAGING_FILTERS = ("mipmap", "box")
"""Filters that average over a footprint."""


def surfaces(request: Request) -> tuple[list[PointStage], bool]:
    """Stages that form the points: geometry, colours, normals, ambient light."""
    if not request.families:
        return [], False
    maps = _textures_of(request, "normal_map")
    bumps = _bumps(request)
    footprints = _footprints(request)
    stages: list[PointStage] = [*footprints, _colors(request)]
    if maps:
        stages.append(TangentFrames(np.logical_or.reduce(list(maps.values()))))
    for name, used in _textures_of(request, "color_texture").items():
        stages.append(ColorTexture(_texture(request, name, "color_texture", used), used))
    for name, used in maps.items():
        stages.append(NormalMap(_texture(request, name, "normal_map", used), used))
    stages.extend(bumps)
    horizon = _horizon(request)
    stages.extend(horizon)
    stages.extend(_ambient(request))
    return stages, bool(horizon)


def _colors(request: Request) -> Colors:
    """Colours of the materials, white where a texture gives them."""
    for kind, numbers in request.kinds().items():
        detail = "each point takes its material's parameters"
        request.list_stage("materials", f"materials.{kind}", detail, request.material_pointers(numbers))
    return Colors(columns([material.color or (1.0, 1.0, 1.0) for material in request.materials]))


def _footprints(request: Request) -> list[Footprints]:
    """Textures that filter ask for footprints, if some shown material looks them up at points."""
    used = [*_textures_of(request, "color_texture"), *_textures_of(request, "normal_map")]
    asking = {
        name for name in used if getattr(request.document.textures[name], "filter", None) in AVERAGING_FILTERS
    }
    if not asking:
        return []
    samples = request.sampling.antialiasing.samples
    pointers = tuple(
        f"/textures/{escaped(name)}/filter" for name in request.document.textures if name in asking
    )
    share = f"1 / {samples} of a pixel" if samples > 1 else "a pixel"
    detail = f"what {share} covers in textures"
    request.list_stage("ray footprints", "textures.footprints", detail, pointers, COSTS.footprint)
    request.reads |= {"coordinates", "derivatives", "viewers"}
    return [footprint_stage.build(build_pinhole(request.document.camera), samples)]


def _textures_of(request: Request, part: str) -> dict[str, Masks]:
    """Masks (materials,) of the materials that use each texture in an attribute."""
    used: dict[str, Masks] = {}
    for i, name in enumerate(request.names):
        texture = getattr(request.document.materials[name], part)
        if texture is not None:
            used.setdefault(texture, np.zeros(len(request.names), dtype=bool))[i] = True
    return used


def _texture(request: Request, name: str, part: str, used: Masks) -> Texture:
    texture = request.document.textures[name]
    asking = request.material_pointers(np.flatnonzero(used), f"/{part}")
    detail = "colours by texture coordinates" if part == "color_texture" else "bends shading normals"
    each = COSTS.lookup * len(asking) / len(request.names)
    effect = f"textures.{texture.type}" if part == "color_texture" else _effect(request, used, part)
    stage, pointers = f"{part.replace('_', ' ')} {name}", (f"/textures/{escaped(name)}", *asking)
    request.list_stage(stage, effect, detail, pointers, each)
    request.reads |= {"coordinates"} if part == "color_texture" else {"coordinates", "frames"}
    return request.texture(name, stored=part == "normal_map")


def _effect(request: Request, used: Masks, part: str) -> str:
    """The effect of a part of materials, by the kind of the first one that asks."""
    return f"materials.{request.materials[int(used.argmax())].type}.{part}"


def _bumps(request: Request) -> list[BumpMap]:
    """One stage for each bump map and height that a shown material asks for."""
    used: dict[tuple[str, float], list[int]] = {}
    for i, name in enumerate(request.names):
        material = request.document.materials[name]
        if material.bump_map is not None:
            used.setdefault((material.bump_map, material.bump_height), []).append(i)
    return [_bump(request, name, height, materials) for (name, height), materials in used.items()]


def _bump(request: Request, name: str, height: float, materials: list[int]) -> BumpMap:
    asking = request.material_pointers(materials, "/bump_map")
    each = LOOKUPS_A_SLOPE * COSTS.lookup * len(asking) / len(request.names)
    detail, pointers = "tilts shading normals by heights", (f"/textures/{escaped(name)}", *asking)
    used = np.isin(np.arange(len(request.names)), materials)
    effect = _effect(request, used, "bump_map")
    request.list_stage(f"bump map {name}", effect, detail, pointers, each)
    request.reads |= {"coordinates", "derivatives"}
    return BumpMap(request.heights(name, height), used)


def _horizon(request: Request) -> list[Horizon]:
    """The end of all that tilts normals, if there is any."""
    numbers = {number for family in request.families for number in family.smooth_shapes().tolist()}
    asking = [f"/shapes/{number}" for number in sorted(numbers)]
    for name in request.names:
        material = request.document.materials[name]
        if material.normal_map is not None:
            asking.append(f"/materials/{escaped(name)}/normal_map")
        if material.bump_map is not None:
            asking.append(f"/materials/{escaped(name)}/bump_map")
    if not asking:
        return []
    detail = "shading normals that point away from the viewer are bent to the horizon"
    request.list_stage("normals at the horizon", "materials.phong", detail, tuple(asking))
    request.reads |= {"viewers"}
    return [Horizon()]


def _ambient(request: Request) -> list[Ambient]:
    strengths: Floats = np.array([material.ambient for material in request.materials], dtype=np.float64)
    asking = request.material_pointers(np.flatnonzero(strengths))
    if not any(request.document.ambient):
        request.leave_out("ambient", "there is no ambient light", "/ambient")
    elif not asking:
        request.leave_out("ambient", "no material in use reflects ambient light", "/ambient")
    else:
        request.list_stage("ambient term", "ambient", "light from all directions", ("/ambient", *asking))
        return [Ambient(strengths, column(request.document.ambient))]
    return []


def material_numbers(request: Request) -> Integers:
    """Material of each shape, (shapes,) int64, as a number among those that are shown."""
    numbers = {name: i for i, name in enumerate(request.names)}
    return np.array([numbers[shape.material] for shape in request.document.shapes], dtype=np.int64)


def leave_out_unused(request: Request) -> None:
    """List materials and textures that no shape shows."""
    shown = {name: request.scene.document.materials[name] for name in request.names}
    for name, material in request.document.materials.items():
        if name not in shown:
            reason = "no shape has this material"
            request.leave_out(f"materials.{material.type}", reason, f"/materials/{escaped(name)}")
    parts = {name for _, name in used_textures({"materials": shown})}
    for name, texture in request.document.textures.items():
        if name not in parts:
            reason = "no material that is shown uses this texture"
            request.leave_out(f"textures.{texture.type}", reason, f"/textures/{escaped(name)}")
