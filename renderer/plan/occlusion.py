"""How families of shapes stand in the way of a light: the stages that mark blocked light points."""

from collections.abc import Callable
from typing import Any

import numpy as np

from renderer.accelerators.boxes import Boxes
from renderer.accelerators.trees import in_tree, inside_of, tree_of
from renderer.lights.emitters import Emitter
from renderer.plan.stages import LightStage
from renderer.shapes.ellipsoids import Ellipsoids
from renderer.shapes.polygons import FlatFamily
from renderer.shapes.triangles import Triangles
from renderer.visibility.ellipsoids import EllipsoidShadows
from renderer.visibility.polygon_grids import GridPolygonShadows
from renderer.visibility.polygon_scatter import ScatterPolygonShadows
from renderer.visibility.solids import SolidShadows
from renderer.visibility.trees import TreeShadows

PairType = np.dtype[np.floating]

Occluder = Callable[[Any, Emitter, PairType, bool], list[LightStage]]
"""Takes a family, a light, the type of pair work and whether to cull."""


def cast_by_polygons(
    family: FlatFamily, emitter: Emitter, dtype: PairType, culling: bool
) -> list[LightStage]:
    """Shadows of few flat primitives, tested one by one."""
    kind = GridPolygonShadows if emitter.shared else ScatterPolygonShadows
    return [kind(family.occluders(), emitter, dtype, culling)]


def cast_by_triangles(
    family: Triangles, emitter: Emitter, dtype: PairType, culling: bool
) -> list[LightStage]:
    """Shadows of triangles: few are tested one by one, many through a tree."""
    if not in_tree(family):
        return cast_by_polygons(family, emitter, dtype, culling)
    solids = _cast_by_solids(family, emitter, dtype) if culling else []
    return [*solids, TreeShadows(family, tree_of(family), emitter, dtype)]


def _cast_by_solids(family: Triangles, emitter: Emitter, dtype: PairType) -> list[LightStage]:
    """What closed meshes hide for sure, of which the tree need not be asked."""
    solids = [solid for solid in inside_of(family) if emitter.is_apart_from(solid.low, solid.high)]
    if not solids:
        return []
    return [SolidShadows(Boxes.joined([solid.boxes for solid in solids]), emitter, dtype)]


def cast_by_ellipsoids(
    family: Ellipsoids, emitter: Emitter, dtype: PairType, culling: bool
) -> list[LightStage]:
    """Shadows of ellipsoids."""
    return [EllipsoidShadows(family, emitter, dtype, culling)]
