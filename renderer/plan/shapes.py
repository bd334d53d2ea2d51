"""Which shapes are built, and how rays meet them."""

from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from renderer.accelerators.meeting import TreeMeeting
from renderer.accelerators.raster import RasterMeeting
from renderer.accelerators.trees import FEW, tree_of
from renderer.assets import AssetError
from renderer.cameras import Pinhole, pinhole
from renderer.errors import SceneError
from renderer.math.arrays import magnitude
from renderer.plan import cost
from renderer.plan.cost import COSTS
from renderer.plan.effects import SHAPES, BuildFamily
from renderer.plan.request import Request
from renderer.plan.stages import RayStage
from renderer.plan.textures import heights_of
from renderer.shapes import Family, displacement
from renderer.shapes.displacement import Displaced
from renderer.shapes.family import Location, Meeting, Outline
from renderer.shapes.triangles import Triangles
from schemas.geometry import no_area
from schemas.materials import PhongMaterial
from schemas.pointers import escaped
from schemas.problems import Problem
from schemas.shapes import Shape, Triangle

if TYPE_CHECKING:
    from renderer.textures.heights import Heights


def families(request: Request) -> list[Family]:
    """Shapes sorted into families, in the order in which kinds first appear.

    Triangles without area are dropped.
    """
    members: dict[BuildFamily, list[int]] = {}
    for number, shape in enumerate(request.document.shapes):
        if isinstance(shape, Triangle) and no_area(shape):
            pointer = (f"/shapes/{number}",)
            request.degenerate += 1
            request.retried += 1
            request.listing.leave_out("shapes.triangle", "its three vertices lie on one line", pointer)
            continue
        if _displacement(request, shape) is None:
            members.setdefault(SHAPES[type(shape)], []).append(number)
    built = [_family(request, build, numbers) for build, numbers in members.items()]
    built.extend(_displaced(request))
    request.retried += sum(
        int(np.count_nonzero(part.retried)) for part in built if isinstance(part, Triangles)
    )
    shown = [part for family in built if (part := _with_area(request, family)) is not None]
    for family in shown:
        _list_family(request, family)
    return shown


def _with_area(request: Request, family: Family) -> Family | None:
    """The family without the meshes of which no triangle has an area; None if there are no others."""
    if not isinstance(family, Triangles):
        return family
    seen = np.isin(family.numbers, family.numbers[magnitude(family.normals) > 0])
    for number in np.unique(family.numbers[~seen]).tolist():
        reason = "no triangle of it has an area"
        request.listing.leave_out(f"shapes.{family.kind}", reason, (f"/shapes/{number}",))
    request.degenerate += int(np.count_nonzero(~seen))
    if seen.all():
        return family
    return family.part(seen) if seen.any() else None


def _displacement(request: Request, shape: Shape) -> PhongMaterial | None:
    """The shape's material if it moves the surface."""
    material = request.document.materials[shape.material]
    return material if material.displacement_map is not None and material.displacement_height else None


def _displaced(request: Request) -> list[Family]:
    """The family of the shapes whose surface is moved."""
    parts, pointers = [], []
    read: dict[tuple[str, float], Heights] = {}
    for number, shape in enumerate(request.document.shapes):
        material = _displacement(request, shape)
        if material is None or material.displacement_map is None:
            continue
        key = (material.displacement_map, material.displacement_height)
        if key not in read:
            read[key] = heights_of(request, *key)
        parts.append(Displaced(number, shape, read[key]))
        pointers.append(f"/materials/{escaped(shape.material)}/displacement_map")
    _list_still(request)
    if not parts:
        return []
    detail = "surfaces cut into fine triangles and moved by heights"
    request.listing.add(
        "displacement", "materials.phong.displacement_map", detail, tuple(dict.fromkeys(pointers))
    )
    return [displacement.build(parts, pinhole.build(request.document.camera), request.scene.assets)]


def _list_still(request: Request) -> None:
    for name in request.names:
        material = request.document.materials[name]
        if material.displacement_map is not None and not material.displacement_height:
            pointer = (f"/materials/{escaped(name)}/displacement_height",)
            request.listing.leave_out("materials.phong.displacement_map", "its height is 0", pointer)


def _family(request: Request, build: BuildFamily, numbers: list[int]) -> Family:
    try:
        return build(numbers, [request.document.shapes[number] for number in numbers], request.scene.assets)
    except AssetError as error:
        raise SceneError((Problem(pointer=error.pointer, detail=str(error), code="asset"),)) from error


def _list_family(request: Request, family: Family) -> None:
    pointers = tuple(f"/shapes/{number}" for number in np.unique(family.numbers).tolist())
    detail, each = "nearest hits of rays", COSTS.shape * cost.met(len(pointers))
    if rasterized(family, request):
        detail, each = "nearest hits: of camera rays by rasterisation, of others through a tree", COSTS.raster
    elif in_tree(family):
        detail, each = "nearest hits of rays through a tree", cost.met_in_tree(family.numbers.size)
    price = cost.seconds(request.rays, each)
    request.listing.add(f"hits of {family.plural}", f"shapes.{family.kind}", detail, pointers, price)


def meeting(request: Request, family: Family, camera: Pinhole) -> RayStage:
    """Few shapes are intersected one by one, many triangles by rasterisation or through a tree."""
    if rasterized(family, request):
        return RasterMeeting(TreeMeeting(family, tree_of(family)), camera)
    return meeting_of(family, Outline.of(family.corners(), camera) if request.culling else None)


def rasterized(family: Family, request: Request) -> TypeGuard[Triangles]:
    """Whether camera rays find a family's triangles on the screen: a pinhole sees each at one place."""
    return in_tree(family) and request.document.camera.lens_radius == 0


def meeting_of(family: Family, outline: Outline | None = None) -> RayStage:
    """A stage for rays from anywhere, unless there are outlines to cull by."""
    return TreeMeeting(family, tree_of(family)) if in_tree(family) else Meeting(family, outline)


def in_tree(family: Family) -> TypeGuard[Triangles]:
    """Whether a family is met through a tree."""
    return isinstance(family, Triangles) and family.numbers.size > FEW


def location(request: Request, family: Family, *, framed: bool, sloped: bool) -> Location:
    """The stage that forms the points on a family."""
    local = np.full(len(request.document.shapes), -1, dtype=np.int64)
    shapes, first = np.unique(family.numbers, return_index=True)
    local[shapes] = first
    pointers = tuple(f"/shapes/{number}" for number in shapes.tolist())
    detail = "positions, normals and texture coordinates of hits" + (", and tangents" if framed else "")
    share = shapes.size / max(1, len(request.document.shapes))
    price = cost.seconds(request.rays * share, COSTS.point)
    request.listing.add(f"points on {family.plural}", f"shapes.{family.kind}", detail, pointers, price)
    return Location(family, local, framed, sloped)


def without_area(family: Family) -> int:
    """Triangles of a mesh that nothing can meet."""
    return int(np.count_nonzero(magnitude(family.normals) == 0)) if isinstance(family, Triangles) else 0
