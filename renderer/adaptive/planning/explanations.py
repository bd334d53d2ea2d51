"""Entries of `penumbra explain` for target quality: how pilot samples differ from samples."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from renderer.adaptive.lattice import first_stride
from renderer.adaptive.levels import COVERAGES
from renderer.adaptive.lighting import MIN_DISTANCE_RATIO, SIDES, PilotLighting
from renderer.math.arrays import Integers
from renderer.plan.effects import TEXTURES
from renderer.plan.plan import RenderPlan
from renderer.plan.request import Request
from renderer.plan.stages import Entry, Illumination
from schemas.pointers import escaped


def in_sequence(plan: RenderPlan, filtered: int) -> tuple[Entry, ...]:
    """Entries of a plan whose number of samples is unknown; textures are `filtered` for this number."""
    pattern = plan.antialiasing.pattern
    details = {
        "camera rays": f"rays through {pattern} places in pixels, as many as the error requires",
        "ray footprints": f"what 1 / {filtered} of a pixel covers in textures",
    }
    return tuple(replace(entry, detail=details.get(entry.name, entry.detail)) for entry in plan.entries)


def entries(request: Request, details: frozenset[str], lightings: Iterable[Illumination]) -> Iterator[Entry]:
    """Entries of the plan: the lattice, each area light, exact means, and border pixels.

    Parameters
    ----------
    request : Request
        Of the pilot samples.
    details : frozenset of str
        Materials with decoupled shading.
    lightings
        Of the pilot samples; lights without area have no entry.
    """
    yield Entry("pilot samples", "camera", _lattice(request), ("/camera",))
    for lighting in lightings:
        if isinstance(lighting, PilotLighting):
            yield from _light(request, lighting)
    yield from _checkerboards(request)
    yield from _details(request, details)
    detail = (
        "rays measure how much of a pixel each shape fills, where it may show more than one: more rays the "
    )
    detail += f"larger the contrast, from {COVERAGES[1]} on"
    yield Entry("borders", "camera", detail, ("/camera",))


def thin_shadows(request: Request, positions: Integers) -> Iterator[Entry]:
    """Entry for pixels that thin shadows may cross, if there are any."""
    count = np.unique(positions[:2], axis=1).shape[1]
    if count:
        pointers = tuple(f"/lights/{number}" for number in range(len(request.document.lights)))
        detail = f"{count:,} pixels that shadows of thin shapes may cross are their own stratum"
        yield Entry("thin shadows", "camera", detail, pointers)


def with_lattice(plan: RenderPlan) -> tuple[Entry, ...]:
    """Entries of a plan with a lens, with one for the lattice of samples after that of the lens."""
    stride = first_stride(plan.document.camera)
    detail = f"pixels {stride} apart are sampled, and those between them where the picture is not smooth"
    (at,) = (i for i, entry in enumerate(plan.entries) if entry.name == "lens")
    lattice = Entry("lattice of samples", "camera.lens", detail, plan.entries[at].pointers)
    return (*plan.entries[: at + 1], lattice, *plan.entries[at + 1 :])


def _lattice(request: Request) -> str:
    stride = first_stride(request.document.camera)
    if stride == 1:
        return "one ray through the centre of each pixel"
    far = f"{stride} pixels apart along rows and columns"
    return f"one ray through the centre of pixels {far}, and of those between where it is not smooth"


def _light(request: Request, light: PilotLighting) -> Iterator[Entry]:
    number = light.emitter.number
    effect, pointer = f"lights.{request.document.lights[number].type}", (f"/lights/{number}",)
    if light.casts:
        points = light.probe.emitter.count
        detail = (
            f"shadow rays to {points} points up to its edges find where all of it is seen, and where a part"
        )
        yield Entry(f"view of light {number}", effect, detail, pointer)
    most = (
        SIDES[min(int(np.searchsorted(SIDES, MIN_DISTANCE_RATIO * light.grid_sides.max())), len(SIDES) - 1)]
        ** 2
    )
    least = SIDES[0] ** 2
    grids = f"a grid of {least} to {most} points" if most > least else f"a grid of {least} points"
    detail = f"{grids}, by how near it is and how sharp the highlight; no shadow rays"
    yield Entry(f"light {number} fully visible", effect, detail, pointer)
    if light.casts:
        emitter = light.partial.emitter
        detail = f"{emitter.count} {emitter.pattern} points with shadow rays"
        yield Entry(f"light {number} partly visible", effect, detail, pointer)


def _checkerboards(request: Request) -> Iterator[Entry]:
    document = request.document
    for texture, board in document.textures.items():
        asking = [name for name in request.names if document.materials[name].color_texture == texture]
        if asking and TEXTURES[type(board)].mean:
            pointers = [f"/materials/{escaped(name)}/color_texture" for name in asking]
            detail = "the exact mean over a pixel, in place of the field at its centre"
            name = f"means of color texture {texture}"
            yield Entry(name, f"textures.{board.type}", detail, (f"/textures/{escaped(texture)}", *pointers))


def _details(request: Request, details: frozenset[str]) -> Iterator[Entry]:
    """Entries of materials with decoupled shading."""
    for name in sorted(details):
        material = request.document.materials[name]
        parts = [part for part in ("color_texture", "normal_map", "bump_map") if getattr(material, part)]
        pointers = tuple(f"/materials/{escaped(name)}/{part}" for part in parts)
        detail = "many places in a pixel share the light that reaches its centre"
        yield Entry(f"detail of {name}", f"materials.{material.type}", detail, pointers)
