"""How rays find the shapes of a scene, and which of two that overlap in one plane comes first."""

from collections.abc import Iterator
from functools import partial
from typing import TypeGuard

import numpy as np

from renderer.accelerators.intersection import TreeIntersector
from renderer.accelerators.raster import RasterIntersector
from renderer.accelerators.trees import in_tree, tree_of
from renderer.cameras import Pinhole
from renderer.interaction import RayStage
from renderer.math.arrays import Integers, Masks
from renderer.plan import cost
from renderer.plan.cost import COSTS
from renderer.plan.request import Request
from renderer.shapes import Family
from renderer.shapes.family import Intersector, Location, Outline
from renderer.shapes.overlaps import First, Overlaps, overlapping, places_of
from renderer.shapes.polygons import FlatFamily
from renderer.shapes.triangles import Triangles


def list_geometry(request: Request) -> None:
    """List the shapes of a plan, and what was left out of them."""
    geometry = request.geometry
    request.left_out.extend(geometry.left_out)
    if geometry.displaced:
        detail = "surfaces cut into fine triangles and moved by heights"
        request.list_stage("displacement", "materials.phong.displacement_map", detail, geometry.displaced)
    for family in geometry.families:
        _list_family(request, family)


def _list_family(request: Request, family: Family) -> None:
    pointers = tuple(f"/shapes/{number}" for number in np.unique(family.numbers).tolist())
    detail, each = "nearest hits of rays", COSTS.shape * cost.near_shapes(len(pointers))
    if rasterized(family, request):
        detail, each = "nearest hits: of camera rays by rasterisation, of others through a tree", COSTS.raster
    elif in_tree(family):
        detail, each = "nearest hits of rays through a tree", cost.through_tree(family.numbers.size)
    request.list_stage(f"hits of {family.plural}", f"shapes.{family.kind}", detail, pointers, each)


def intersector(request: Request, family: Family, camera: Pinhole) -> RayStage:
    """Few shapes are intersected one by one, many triangles by rasterisation or through a tree."""
    if rasterized(family, request):
        return RasterIntersector(TreeIntersector(family, tree_of(family)), camera)
    return intersector_of(family, Outline.of(family.corners(), camera) if request.culling else None)


def rasterized(family: Family, request: Request) -> TypeGuard[Triangles]:
    """Whether camera rays find a family's triangles on the screen: a pinhole sees each at one place."""
    return in_tree(family) and request.document.camera.lens_radius == 0


def intersector_of(family: Family, outline: Outline | None = None) -> RayStage:
    """A stage for rays from anywhere, unless there are outlines to cull by."""
    return TreeIntersector(family, tree_of(family)) if in_tree(family) else Intersector(family, outline)


def location(request: Request, family: Family, *, framed: bool, sloped: bool) -> Location:
    """The stage that forms the points on a family."""
    local = np.full(len(request.document.shapes), -1, dtype=np.int64)
    shapes, first = np.unique(family.numbers, return_index=True)
    local[shapes] = first
    pointers = tuple(f"/shapes/{number}" for number in shapes.tolist())
    detail = "positions, normals and texture coordinates of hits" + (", and tangents" if framed else "")
    share = shapes.size / max(1, len(request.document.shapes))
    name, each = f"points on {family.plural}", COSTS.point * share
    request.list_stage(name, f"shapes.{family.kind}", detail, pointers, each)
    return Location(family, local, framed, sloped)


def overlaps(request: Request) -> list[RayStage]:
    """What comes first of flat shapes that overlap in one plane, unless all of these are in trees."""
    flat = [family for family in request.families if isinstance(family, FlatFamily)]
    firsts = [first for family in flat if not in_tree(family) for first in _firsts(family, flat)]
    if not firsts:
        return []
    detail = "of those that overlap the first of the scene is hit"
    each = COSTS.shape * cost.near_shapes(len(firsts))
    request.list_stage("shapes in one plane", "shapes", detail, ("/shapes",), each)
    return [Overlaps(places_of(flat, len(request.document.shapes)), tuple(firsts))]


def _firsts(family: FlatFamily, flat: list[FlatFamily]) -> Iterator[First]:
    """What the shapes of a family come before, and what in trees comes before them."""
    begins = np.cumsum([0, *(other.numbers.size for other in flat)])
    shapes, places = [], []
    for begin, other in zip(begins, flat, strict=False):
        some, others = overlapping(family, other)
        after = family.numbers[some] < other.numbers[others]
        shapes.append(some[after])
        places.append(begin + others[after])
        if in_tree(other):
            own = begins[flat.index(family)] + some[~after]
            yield from _trees_first(other, own, others[~after], begins[-1])
    first, before = np.concatenate(shapes), np.concatenate(places)
    for shape in np.unique(first):
        yield First(partial(family.intersect, int(shape)), _marked(before[first == shape], begins[-1]))


def _trees_first(tree: Triangles, shapes: Integers, triangles: Integers, count: int) -> Iterator[First]:
    """Triangles in trees that come before shapes tested one by one, of pairs of both (P,)."""
    for shape in np.unique(shapes):
        part = tree.part(np.unique(triangles[shapes == shape]))
        yield First(intersector_of(part).run, _marked(shape, count))


def _marked(places: Integers, count: int) -> Masks:
    marks = np.zeros(count + 1, dtype=bool)
    marks[places] = True
    return marks
