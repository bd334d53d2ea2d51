"""Trees of triangles, built once for the same triangles."""

import hashlib
from collections import OrderedDict

import numpy as np

from renderer.accelerators import bvh
from renderer.accelerators.bvh import Bvh
from renderer.shapes.triangles import Triangles

FEW = 32
"""Up to so many triangles are met one by one: culling by block costs less than a tree."""

KEPT = 4
"""Trees that a process keeps, the last ones used."""

_trees: OrderedDict[bytes, Bvh] = OrderedDict()


def tree_of(family: Triangles) -> Bvh:
    """The tree of a family; one for the same vertices is used again."""
    key = hashlib.sha256(np.ascontiguousarray(family.vertices).data).digest()
    tree = _trees.pop(key, None)
    if tree is None:
        tree = bvh.build(family.vertices.min(axis=0), family.vertices.max(axis=0))
    _trees[key] = tree
    while len(_trees) > KEPT:
        _trees.popitem(last=False)
    return tree
