"""Scattering of mirrors and glass, and the throughput cut-off."""

from collections.abc import Iterator, Sequence

import numpy as np

from renderer.materials.bounces import MirrorRays, TransmittedRays
from renderer.math.arrays import Floats
from renderer.plan.cost import COSTS
from renderer.plan.effects import MATERIALS, TEXTURES
from renderer.plan.request import Request
from renderer.plan.stages import ScatteringStage
from renderer.plan.surfaces import material_numbers
from schemas.lights import Light
from schemas.materials import Surface
from schemas.pointers import escaped


def stages(request: Request) -> tuple[ScatteringStage, ...]:
    """Stages that send rays from points; none where no visible material needs them."""
    found: list[ScatteringStage] = []
    faintest = least_throughput(request)
    depths = np.array([material.max_depth for material in request.materials], dtype=np.int64)
    if _asked(request, "mirror", "mirror rays", "what mirrors show"):
        found.append(MirrorRays(_numbers(request, "mirror"), depths, faintest))
    detail = "refracted rays, and reflected ones by Fresnel's formulas"
    if _asked(request, "transmission", "transmitted rays", detail):
        strengths, indices = _numbers(request, "transmission"), _numbers(request, "ior")
        found.append(TransmittedRays(strengths, depths, faintest, indices, material_numbers(request)))
    return tuple(found)


def transparent(request: Request) -> bool:
    """Whether light goes through some material that is shown."""
    return any(material.transmission for material in request.materials)


def _numbers(request: Request, part: str) -> Floats:
    return np.array([getattr(material, part) for material in request.materials], dtype=np.float64)


def _asked(request: Request, part: str, stage: str, detail: str) -> bool:
    """List the stage at the price of one ray a camera ray, and the materials that ask without effect."""
    asking, kinds = [], []
    for name, material in zip(request.names, request.materials, strict=True):
        pointer = f"/materials/{escaped(name)}/{part}"
        if getattr(material, part) > 0:
            asking.append(pointer)
            kinds.append(material.type)
        elif part in material.model_fields_set:
            request.leave_out(f"materials.{material.type}.{part}", f"{pointer} is 0", pointer)
    if asking:
        request.list_stage(stage, f"materials.{kinds[0]}.{part}", detail, tuple(asking), COSTS.bounce)
        request.reads |= {"viewers"}
    return bool(asking)


THROUGHPUT_CUT_OFF = 2.0**-24
"""Half the spacing of float32 at 1: smaller contributions are invisible beside white in a linear picture, and
12 stops below the steps of 8 bits."""

CHANNELS = range(3)


def least_throughput(request: Request) -> float:
    """Throughput below which a path ends, so that what is cut off is at most `THROUGHPUT_CUT_OFF`.

    Where no radiance is above 1 it is `THROUGHPUT_CUT_OFF` itself, so that a dark scene keeps its digits. It
    is 0 where nothing bounds the light: physical falloff grows beyond any number towards the light.
    """
    document = request.document
    if any(_falls(light) for light in document.lights if any(light.color)):
        return 0.0
    materials = request.materials
    emitted = [document.background, *(light.color for light in document.lights)]
    brightest = max([*map(max, emitted), *_scattered(request, materials)])
    return THROUGHPUT_CUT_OFF / max(1.0, brightest * _bounces(materials))


def _falls(light: Light) -> bool:
    return getattr(light, "falloff", "none") == "physical"


def _scattered(request: Request, materials: Sequence[Surface]) -> Iterator[float]:
    """Greatest radiance of each material by its own light."""
    document = request.document
    light = [sum(lamp.color[i] for lamp in document.lights) for i in CHANNELS]
    for material in materials:
        color, brightest = _brightest_color(request, material), MATERIALS[type(material)].brightest
        yield max(
            document.ambient[i] * material.ambient * color[i] + brightest(material, light[i], color[i])
            for i in CHANNELS
        )


def _brightest_color(request: Request, material: Surface) -> tuple[float, ...]:
    """Greatest value of each channel."""
    if material.color is not None:
        return material.color
    name = material.color_texture or ""
    effect = TEXTURES[type(request.document.textures[name])]
    return effect.brightest(request.texture(name, stored=False))


def _bounces(materials: Sequence[Surface]) -> float:
    """Sum of the weights of all points along a path that begins with weight 1.

    A bounce sends on no more than the material's `mirror` and `transmission` together.
    """
    sending = [each for each in materials if each.mirror or each.transmission]
    share = max((material.mirror + material.transmission for material in sending), default=0.0)
    deepest = max((material.max_depth for material in sending), default=0)
    return sum(share**bounce for bounce in range(deepest + 1))
