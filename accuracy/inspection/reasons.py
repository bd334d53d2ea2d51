"""Sentences that explain the colour of a pixel."""

import math
from collections.abc import Iterator

from accuracy.inspection.shares import NEGLIGIBLE_SHARE, Shares, luminance
from schemas.api.inspections import Blocker, InspectedLight, InspectedRay, InspectedSurface, Part, Reason
from schemas.lights import Light, SpotLight
from schemas.scene import Scene

SHOWS = {
    "mirror": "A mirror shows what lies before it: {:.3g} of the mirrored ray's radiance is added",
    "reflection": "Glass reflects what lies before it: {:.3g} of the reflected ray's radiance is added",
    "refraction": "Glass shows what lies behind it: {:.3g} of the refracted ray's radiance is added",
}
"""Contribution of a scattered ray, by its weight."""


def reasons(scene: Scene, ray: InspectedRay) -> tuple[Reason, ...]:
    """Sentences about the hit of a camera ray, the largest contribution to the pixel first.

    A light counts with what it would add if nothing blocked it, so that a shadow comes before what lights it.
    """
    if ray.surface is None:
        return (_no_shape(scene, ray),)
    shares = Shares(ray)
    lights = sorted(ray.surface.lights, key=lambda light: -luminance(light.unblocked))
    added = [shares.of_light(ray, light) for light in lights]
    clauses = [
        _of_light(scene, ray.surface, light, share) for light, share in zip(lights, added, strict=True)
    ]
    seen = [(shares.unblocked(ray, light), one) for light, one in zip(lights, clauses, strict=True)]
    if not any(share > NEGLIGIBLE_SHARE for share in added):
        dark = [_alone(clauses[0]), *clauses[1:]] if clauses else [_dark_scene()]
        # These sentences belong together: why there is no light, then what remains.
        seen = [(shares.of_ambient(ray), reason) for reason in (*dark, _ambient(scene, ray.surface))]
    black = [(shares.own(ray), reason) for reason in _black(ray.surface)]
    found = [*black, *seen, *_sent_on(scene, ray, shares)]
    ordered = sorted(found, key=lambda pair: -pair[0] if pair[0] > NEGLIGIBLE_SHARE else 0.0)
    return tuple(reason for _, reason in ordered)


def _no_shape(scene: Scene, ray: InspectedRay) -> Reason:
    if ray.light is not None:
        shown = "which is black" if not any(ray.radiance) else "in its flat colour"
        text = f"The camera looks at {_light_at(scene, ray.light)} itself, {shown}."
        return Reason(code="light_seen", text=text, pointers=(ray.light.pointer,))
    shown = "the background" + ("" if any(scene.background) else ", which is black")
    text = f"The camera ray hits no shape: this is {shown}."
    return Reason(code="background", text=text, pointers=("/background",))


def _black(surface: InspectedSurface) -> Iterator[Reason]:
    if any(surface.color):
        return
    if surface.texture is not None:
        text = f"The texture `{surface.texture.name}` is black at this point."
        yield Reason(code="black_texture", text=text, pointers=(surface.texture.pointer,))
    else:
        text = f"The colour of the material `{surface.material.name}` is black."
        yield Reason(code="black_material", text=text, pointers=(surface.material.pointer,))


def _of_light(scene: Scene, surface: InspectedSurface, light: InspectedLight, share: float) -> Reason:
    """A clause about one light, which may begin a sentence or follow a colon."""
    name, place = _light(scene, light.light), light.pointer
    if not any(scene.lights[light.light].color):
        return _reason("black_light", f"{name} is black", place)
    if light.turned_away:
        cone = isinstance(scene.lights[light.light], SpotLight)
        text = f"the point lies outside the cone of {name}" if cone else f"{name} shines away from the point"
        return _reason("light_turned_away", text, place)
    if light.below_horizon == light.points:
        return _reason("faces_away", f"the surface faces away from {name}", place, surface.part.pointer)
    if light.blocked == light.points - light.below_horizon:
        return _blocked(scene, surface, light)
    if not any(light.diffuse) and not any(light.specular):
        text = f"the material `{surface.material.name}` reflects no light from {name}"
        return _reason("unanswered", text, place, surface.material.pointer)
    if share <= NEGLIGIBLE_SHARE:
        text = f"{name} adds less than {100 * NEGLIGIBLE_SHARE:.2g} % of the brightness of the pixel"
        text += _weakened(scene.lights[light.light])
        return _reason("unanswered", text, place, surface.material.pointer)
    return _lit(scene, surface, light)


def _blocked(scene: Scene, surface: InspectedSurface, light: InspectedLight) -> Reason:
    points = f"all {light.blocked} points of " if light.points > 1 else ""
    rest = " that are not behind the surface" if light.below_horizon else ""
    text = f"{_block(scene, surface, light)} {points}{_light(scene, light.light)}{rest}"
    return _reason("blocked", text, light.pointer, *(blocker.pointer for blocker in light.blockers))


def _block(scene: Scene, surface: InspectedSurface, light: InspectedLight) -> str:
    """Subject and verb. A curved surface may block a light itself."""
    if not light.blockers:
        return f"{_shape(scene, surface.shape)} itself blocks"
    return f"{_names(scene, light.blockers)} block{'' if len(light.blockers) > 1 else 's'}"


def _lit(scene: Scene, surface: InspectedSurface, light: InspectedLight) -> Reason:
    name, cosine = _light(scene, light.light), max(-1.0, min(1.0, light.cosine))
    angle, shown = math.degrees(math.acos(cosine)), 100 * max(0.0, cosine)
    slanted = f"{angle:.0f} degrees from the normal, where a matte surface shows {shown:.0f} %"
    slanted += _weakened(scene.lights[light.light])
    if light.visibility == 1:
        return _reason("lit", f"{name} is fully visible, {slanted}", light.pointer)
    hidden = [f"{_block(scene, surface, light)} {light.blocked}"] if light.blocked else []
    if light.below_horizon:
        hidden.append(f"{light.below_horizon} are behind the surface")
    text = f"{name} is partly visible: of its {light.points} points, {' and '.join(hidden)}"
    pointers = (blocker.pointer for blocker in light.blockers)
    return _reason("partly_lit", f"{text}; the light is {slanted}", light.pointer, *pointers)


def _weakened(light: Light) -> str:
    """Causes of a weak visible light other than the angle, as a clause."""
    cone = "; its cone fades towards the edge" if isinstance(light, SpotLight) else ""
    physical = getattr(light, "falloff", "none") == "physical"
    return cone + ("; its physical falloff depends on the distance" if physical else "")


def _names(scene: Scene, blockers: tuple[Blocker, ...]) -> str:
    names = [_shape(scene, one.shape) for one in blockers]
    if len(names) > 3:
        return f"{names[0]} and {len(names) - 1} other shapes"
    return " and ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else names[0]


def _shape(scene: Scene, number: int) -> str:
    shape = scene.shapes[number]
    return f"shape {number} " + (f"`{shape.name}`" if shape.name else f"({shape.type})")


def _light(scene: Scene, number: int) -> str:
    return f"light {number} ({scene.lights[number].type})"


def _light_at(scene: Scene, part: Part) -> str:
    return _light(scene, int(part.pointer.rpartition("/")[2]))


def _reason(code: str, clause: str, *pointers: str) -> Reason:
    return Reason(code=code, text=f"{clause[0].upper()}{clause[1:]}.", pointers=pointers)


def _alone(first: Reason) -> Reason:
    """The first sentence about lights if none contributes."""
    text = f"This point is unlit: {first.text[0].lower()}{first.text[1:]}"
    return first.model_copy(update={"text": text})


def _dark_scene() -> Reason:
    return Reason(code="no_lights", text="This point is unlit: the scene has no lights.", pointers=("",))


def _ambient(scene: Scene, surface: InspectedSurface) -> Reason:
    share = scene.materials[surface.material.name or ""].ambient
    if any(surface.ambient):
        text = f"Only ambient light is left, {share:g} of the colour."
        return Reason(code="ambient_only", text=text, pointers=("/ambient", surface.material.pointer))
    if not any(scene.ambient):
        return Reason(code="no_ambient", text="There is no ambient light either.", pointers=("/ambient",))
    text = f"The material `{surface.material.name}` reflects no ambient light."
    return Reason(code="no_ambient", text=text, pointers=("/ambient", surface.material.pointer))


def _sent_on(scene: Scene, ray: InspectedRay, shares: Shares) -> Iterator[tuple[float, Reason]]:
    """Sentences about scattered rays with their shares, without those that add nothing to a lit pixel."""
    assert ray.surface is not None
    for following in ray.rays:
        share = shares.beyond(following)
        text = SHOWS[following.kind].format(following.weight / ray.weight)
        if shares.total > 0:
            if share <= NEGLIGIBLE_SHARE:
                continue
            source = _source(scene, shares.brightest(following))
            text += f", {100 * share:.0f} % of the brightness of the pixel, most of it from {source}"
        pointers = (ray.surface.material.pointer,)
        yield share, Reason(code=following.kind, text=f"{text}.", pointers=pointers)


def _source(scene: Scene, ray: InspectedRay) -> str:
    """Name of what a ray hits, for a sentence."""
    if ray.surface is not None:
        return _shape(scene, ray.surface.shape)
    if ray.light is not None:
        return _light_at(scene, ray.light)
    return "the background"
