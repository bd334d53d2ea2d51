"""Sentences that explain the colour of a pixel."""

import math
from collections.abc import Iterator

from accuracy.inspection.shares import NEGLIGIBLE_SHARE, Shares
from schemas.api.inspections import Blocker, InspectedLight, InspectedRay, InspectedSurface, Reason
from schemas.lights import SpotLight
from schemas.scene import Scene

SHOWS = {
    "mirror": "a mirror shows what lies before it",
    "reflection": "glass reflects what lies before it",
    "refraction": "glass shows what lies behind it",
}
"""Contribution of a scattered ray."""


def reasons(scene: Scene, ray: InspectedRay) -> tuple[Reason, ...]:
    """Sentences about the hit of a camera ray, the largest contribution to the pixel first."""
    if ray.surface is None:
        return (_no_shape(scene, ray),)
    shares = Shares(ray)
    lights = [(shares.of_light(ray, light), light) for light in ray.surface.lights]
    seen = [(share, _of_light(scene, ray.surface, light, share)) for share, light in lights]
    if not any(share > NEGLIGIBLE_SHARE for share, _ in lights):
        dark = [_alone(seen[0][1]), *(reason for _, reason in seen[1:])] if seen else [_dark_scene()]
        # These sentences belong together: why there is no light, then what remains.
        seen = [(shares.of_ambient(ray), reason) for reason in (*dark, _ambient(scene, ray.surface))]
    black = [(shares.own(ray), reason) for reason in _black(ray.surface)]
    found = [*black, *seen, *_sent_on(ray, shares)]
    ordered = sorted(found, key=lambda pair: -pair[0] if pair[0] > NEGLIGIBLE_SHARE else 0.0)
    return tuple(reason for _, reason in ordered)


def _no_shape(scene: Scene, ray: InspectedRay) -> Reason:
    if ray.light is not None:
        shown = "which is black" if not any(ray.radiance) else "in its flat colour"
        text = f"The camera looks at light {ray.light.pointer.rpartition('/')[2]} itself, {shown}."
        return Reason(code="light_seen", text=text, pointers=(ray.light.pointer,))
    shown = "the background" + ("" if any(scene.background) else ", which is black")
    return Reason(code="background", text=f"There is no shape: this is {shown}.", pointers=("/background",))


def _black(surface: InspectedSurface) -> Iterator[Reason]:
    if any(surface.color):
        return
    if surface.texture is not None:
        text = f"The texture `{surface.texture.name}` is black there."
        yield Reason(code="black_texture", text=text, pointers=(surface.texture.pointer,))
    else:
        text = f"The colour of the material `{surface.material.name}` is black."
        yield Reason(code="black_material", text=text, pointers=(surface.material.pointer,))


def _of_light(scene: Scene, surface: InspectedSurface, light: InspectedLight, share: float) -> Reason:
    """A clause about one light, which may begin a sentence or follow a colon."""
    name, place = f"light {light.light}", light.pointer
    if not any(scene.lights[light.light].color):
        return _reason("black_light", f"{name} is black", place)
    if light.turned_away:
        cone = isinstance(scene.lights[light.light], SpotLight)
        where = "into a cone that does not reach here" if cone else "to the other side only"
        return _reason("light_turned_away", f"{name} shines {where}", place)
    if light.below_horizon == light.points:
        return _reason("faces_away", f"the surface faces away from {name}", place, surface.part.pointer)
    if light.blocked == light.points - light.below_horizon:
        return _blocked(light)
    if not any(light.diffuse) and not any(light.specular):
        text = f"the material `{surface.material.name}` reflects no light from {name}"
        return _reason("unanswered", text, place, surface.material.pointer)
    if share <= NEGLIGIBLE_SHARE:
        text = f"the material `{surface.material.name}` reflects next to no light from {name}"
        return _reason("unanswered", text, place, surface.material.pointer)
    return _lit(light)


def _blocked(light: InspectedLight) -> Reason:
    pointers = (light.pointer, *(blocker.pointer for blocker in light.blockers))
    which = _names(light.blockers) if light.blockers else "the shape itself"
    verb = "lie" if len(light.blockers) > 1 else "lies"
    whole = "" if light.points == 1 else f" from all {light.blocked} points"
    if light.blocked > 1 and light.below_horizon:
        whole = f" from the {light.blocked} points that are not behind the surface"
    return _reason("blocked", f"{which} {verb} between it and light {light.light}{whole}", *pointers)


def _lit(light: InspectedLight) -> Reason:
    angle = math.degrees(math.acos(max(-1.0, min(1.0, light.cosine))))
    name = f"light {light.light}"
    cosine = max(0.0, light.cosine)
    slanted = f"{angle:.0f} degrees from the normal, where a matte surface shows {100 * cosine:.0f} %"
    seen = light.points - light.below_horizon - light.blocked
    if seen == light.points:
        return _reason("lit", f"{name} is fully visible, {slanted}", light.pointer)
    hidden = [f"{light.below_horizon} are behind the surface"] if light.below_horizon else []
    if light.blockers:
        hidden.append(
            f"{_names(light.blockers)} hide{'' if len(light.blockers) > 1 else 's'} {light.blocked}"
        )
    text = f"{name} is partly visible: {seen} of {light.points} points; {', '.join(hidden)}; it is {slanted}"
    return _reason("partly_lit", text, light.pointer, *(blocker.pointer for blocker in light.blockers))


def _names(blockers: tuple[Blocker, ...]) -> str:
    names = [_named(one.shape, one.name) for one in blockers]
    if len(names) > 3:
        return f"{names[0]} and {len(names) - 1} other shapes"
    return " and ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else names[0]


def _named(shape: int, name: str | None) -> str:
    return f"shape {shape}" + (f" `{name}`" if name else "")


def _reason(code: str, clause: str, *pointers: str) -> Reason:
    return Reason(code=code, text=f"{clause[0].upper()}{clause[1:]}.", pointers=pointers)


def _alone(first: Reason) -> Reason:
    """The first sentence about lights if none contributes."""
    text = f"Nothing lights it: {first.text[0].lower()}{first.text[1:]}"
    return first.model_copy(update={"text": text})


def _dark_scene() -> Reason:
    return Reason(code="no_lights", text="Nothing lights it: the scene has no lights.", pointers=("",))


def _ambient(scene: Scene, surface: InspectedSurface) -> Reason:
    share = scene.materials[surface.material.name or ""].ambient
    if any(surface.ambient):
        text = f"Only ambient light is left, {share:g} of the colour."
        return Reason(code="ambient_only", text=text, pointers=("/ambient", surface.material.pointer))
    if not any(scene.ambient):
        return Reason(code="no_ambient", text="There is no ambient light either.", pointers=("/ambient",))
    text = f"The material `{surface.material.name}` reflects no ambient light."
    return Reason(code="no_ambient", text=text, pointers=("/ambient", surface.material.pointer))


def _sent_on(ray: InspectedRay, shares: Shares) -> Iterator[tuple[float, Reason]]:
    """Sentences about scattered rays with their shares, without those that add nothing to a lit pixel."""
    assert ray.surface is not None
    for following in ray.rays:
        share = shares.beyond(following)
        weight = following.weight / ray.weight
        text = f"{SHOWS[following.kind].capitalize()}: {weight:.3g} of the radiance along that ray is added"
        if shares.total > 0:
            if share <= NEGLIGIBLE_SHARE:
                continue
            source = _source(shares.brightest(following))
            text += f", {100 * share:.0f} % of the brightness of the pixel, most of it from {source}"
        pointers = (ray.surface.material.pointer,)
        yield share, Reason(code=following.kind, text=f"{text}.", pointers=pointers)


def _source(ray: InspectedRay) -> str:
    """Name of what a ray hits, for a sentence."""
    if ray.surface is not None:
        return _named(ray.surface.shape, ray.surface.part.name)
    if ray.light is not None:
        return f"light {ray.light.pointer.rpartition('/')[2]}"
    return "the background"
