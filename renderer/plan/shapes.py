"""Intersectors of a scene's shapes, and tie-breaks of coplanar overlaps."""

from typing import TypeGuard

import numpy as np

from renderer.accelerators.intersection import TreeIntersector
from renderer.accelerators.raster import RasterIntersector
from renderer.accelerators.trees import in_tree, tree_of
from renderer.cameras import Pinhole
from renderer.interaction import RayStage, Viewers
from renderer.plan import cost
from renderer.plan.cost import COSTS
from renderer.plan.request import Request
from renderer.plan.stages import PointStage
from renderer.shapes import Family
from renderer.shapes.family import Intersector, Location, Outline
from renderer.shapes.triangles import Triangles

PROBE_OFFSETS = (np.arange(4) + 0.5) / 2 - 1
"""Offsets of probe rays in each axis, in units of half the picture's side: sixteen probes in all."""

MOST_PROBED = 4096
"""Shapes of a family that are probed: a few hundredths of a second."""

FEW_COVERING = 8.0
"""Triangles whose bounds a camera ray passes: twice those of a closed mesh behind another one."""


def list_geometry(request: Request, camera: Pinhole) -> None:
    """List the shapes of a plan, and those left out."""
    geometry = request.geometry
    request.left_out.extend(geometry.left_out)
    if geometry.displaced:
        detail = "surfaces cut into fine triangles and moved by heights"
        request.list_stage("displacement", "materials.phong.displacement_map", detail, geometry.displaced)
    for family in geometry.families:
        few = FEW_COVERING if in_tree(family) else cost.near_shapes(family.numbers.size)
        request.crowds[family.kind] = max(0.0, crowd(family, camera) - few)
        _list_family(request, family)


def crowd(family: Family, camera: Pinhole) -> float:
    """Mean number of shapes that a camera ray may hit, by their bounds at some places of the picture.

    Those of meshes are left out: services price scenes before they read meshes.
    """
    _, shapes, counts = np.unique(family.numbers, return_inverse=True, return_counts=True)
    alone = np.flatnonzero(counts[shapes] == 1)
    placed = alone[:: 1 + alone.size // MOST_PROBED]
    if alone.size <= FEW_COVERING:
        return 0.0
    outline = Outline.of(family.corners()[:, :, placed], camera)
    x, y = PROBE_OFFSETS * camera.half_width, PROBE_OFFSETS * camera.half_height
    found = [outline.inside(np.array([a, a, b, b])).mean() for a in x for b in y]
    return float(np.mean(found)) * alone.size


def _list_family(request: Request, family: Family) -> None:
    pointers = tuple(f"/shapes/{number}" for number in np.unique(family.numbers).tolist())
    detail, each = "nearest hits of rays", COSTS.shape * cost.near_shapes(len(pointers))
    if rasterized(family, request):
        detail, each = "nearest hits: of camera rays by rasterisation, of others through a tree", COSTS.raster
    elif in_tree(family):
        detail, each = "nearest hits of rays through a tree", cost.through_tree(family.numbers.size)
    crowded = COSTS.crowd_raster if in_tree(family) else COSTS.crowd
    each += crowded * request.crowds[family.kind]
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


def list_points(request: Request) -> None:
    """List the points on each family."""
    for family in request.families:
        shapes = np.unique(family.numbers)
        pointers = tuple(f"/shapes/{number}" for number in shapes.tolist())
        name, each = f"points on {family.plural}", COSTS.point * shapes.size / len(request.document.shapes)
        request.list_stage(name, f"shapes.{family.kind}", "positions and normals of hits", pointers, each)


def location(request: Request) -> list[PointStage]:
    """The stages that form points, with all attributes that the other stages, listed by now, read."""
    local = np.full((len(request.families), len(request.document.shapes)), -1, dtype=np.int64)
    for row, family in zip(local, request.families, strict=True):
        shapes, first = np.unique(family.numbers, return_index=True)
        row[shapes] = first
    viewers = [Viewers()] if "viewers" in request.reads else []
    return [Location(request.families, local, frozenset(request.reads)), *viewers]


def overlaps(request: Request) -> list[RayStage]:
    """Stage that resolves overlaps by scene order, if the scene has any."""
    stage = request.geometry.overlaps
    if stage is None:
        return []
    detail = "of those that overlap the first of the scene is hit"
    each = COSTS.shape * cost.near_shapes(int(np.count_nonzero(stage.later)))
    request.list_stage("shapes in one place", "shapes", detail, ("/shapes",), each)
    return [stage]
