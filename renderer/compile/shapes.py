"""Which shapes are built, and how rays meet them."""

import numpy as np

from renderer import cost
from renderer.accelerators.meeting import TreeMeeting
from renderer.accelerators.trees import FEW, tree_of
from renderer.arrays import magnitude
from renderer.assets import AssetError
from renderer.cameras import Pinhole
from renderer.compile.request import Request
from renderer.cost import COSTS
from renderer.effects import SHAPES, BuildFamily
from renderer.errors import SceneError
from renderer.shapes import Family
from renderer.shapes.family import Location, Meeting, Outline
from renderer.shapes.triangles import Triangles
from renderer.stages import RayStage
from schemas.geometry import no_area
from schemas.problems import Problem
from schemas.shapes import Triangle


def families(request: Request) -> list[Family]:
    """Shapes sorted into families, in the order in which kinds first appear.

    Triangles without area are dropped.
    """
    members: dict[BuildFamily, list[int]] = {}
    for number, shape in enumerate(request.document.shapes):
        if isinstance(shape, Triangle) and no_area(shape):
            pointer = (f"/shapes/{number}",)
            request.degenerate += 1
            request.listing.leave_out("shapes.triangle", "its three vertices lie on one line", pointer)
            continue
        members.setdefault(SHAPES[type(shape)], []).append(number)
    built = []
    for build, numbers in members.items():
        family = _family(request, build, numbers)
        _list_family(request, family)
        built.append(family)
    return built


def _family(request: Request, build: BuildFamily, numbers: list[int]) -> Family:
    try:
        return build(numbers, [request.document.shapes[number] for number in numbers], request.scene.assets)
    except AssetError as error:
        raise SceneError((Problem(pointer=error.pointer, detail=str(error), code="asset"),)) from error


def _list_family(request: Request, family: Family) -> None:
    pointers = tuple(f"/shapes/{number}" for number in np.unique(family.numbers).tolist())
    price = cost.seconds(request.rays, COSTS.shape * cost.met(len(pointers)))
    request.listing.add(
        f"hits of {family.kind}s", f"shapes.{family.kind}", "nearest hits of rays", pointers, price
    )


def meeting(request: Request, family: Family, camera: Pinhole) -> RayStage:
    """Few shapes are met one by one, many triangles through a tree."""
    if isinstance(family, Triangles) and family.numbers.size > FEW:
        return TreeMeeting(family, tree_of(family))
    return Meeting(family, Outline.of(family.corners(), camera) if request.culling else None)


def location(request: Request, family: Family, *, framed: bool) -> Location:
    local = np.full(len(request.document.shapes), -1, dtype=np.int64)
    shapes, first = np.unique(family.numbers, return_index=True)
    local[shapes] = first
    pointers = tuple(f"/shapes/{number}" for number in shapes.tolist())
    detail = "positions, normals and texture coordinates of hits" + (", and tangents" if framed else "")
    share = family.numbers.size / max(1, len(request.document.shapes))
    price = cost.seconds(request.rays * share, COSTS.point)
    request.listing.add(f"points on {family.kind}s", f"shapes.{family.kind}", detail, pointers, price)
    return Location(family, local, framed)


def without_area(family: Family) -> int:
    """Triangles of a mesh that nothing can meet."""
    return int(np.count_nonzero(magnitude(family.normals) == 0)) if isinstance(family, Triangles) else 0
