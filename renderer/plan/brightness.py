"""How much light a path can still bring, and so from which weight on no picture shows it."""

from collections.abc import Iterator

from renderer.plan.effects import TEXTURES
from renderer.plan.request import Request
from schemas.lights import Light
from schemas.materials import PhongMaterial

UNSEEN = 2.0**-24
"""Half the spacing of float32 at 1: a linear picture cannot show less beside white, nor one of 8 bits less
than 12 stops below it."""

CHANNELS = range(3)


def faintest_weight(request: Request) -> float:
    """Weight up to which a path ends: all that it can still add is at most `UNSEEN`, dimensionless.

    Where no radiance is above 1 it is `UNSEEN` itself, so that a dark scene keeps its digits. It is 0 where
    nothing bounds the light: physical falloff grows beyond any number towards the light.
    """
    document = request.document
    if any(_falls(light) for light in document.lights if any(light.color)):
        return 0.0
    materials = [document.materials[name] for name in request.names]
    emitted = [document.background, *(light.color for light in document.lights)]
    brightest = max([*map(max, emitted), *_scattered(request, materials)])
    return UNSEEN / max(1.0, brightest * _bounces(materials))


def _falls(light: Light) -> bool:
    return getattr(light, "falloff", "none") == "physical"


def _scattered(request: Request, materials: list[PhongMaterial]) -> Iterator[float]:
    """Greatest radiance by the Phong model of each material, all cosines taken as 1."""
    document = request.document
    light = [sum(lamp.color[i] for lamp in document.lights) for i in CHANNELS]
    for material in materials:
        color = _brightest_color(request, material)
        yield max(
            document.ambient[i] * material.ambient * color[i]
            + light[i] * (material.diffuse * color[i] + material.specular)
            for i in CHANNELS
        )


def _brightest_color(request: Request, material: PhongMaterial) -> tuple[float, ...]:
    """Greatest value of each channel."""
    if material.color is not None:
        return material.color
    texture = request.document.textures[material.color_texture or ""]
    return TEXTURES[type(texture)].brightest(texture)


def _bounces(materials: list[PhongMaterial]) -> float:
    """Sum of the weights of all places along a path that begins with weight 1.

    A bounce sends on no more than the material's `mirror` and `transmission` together.
    """
    share = max((material.mirror + material.transmission for material in materials), default=0.0)
    deepest = max((material.max_depth for material in materials), default=0)
    return sum(share**bounce for bounce in range(deepest + 1))
