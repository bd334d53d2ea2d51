"""Trees that find the few triangles a ray may hit, built once for the same triangles."""

import hashlib
import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeGuard, TypeVar

import numpy as np

from renderer.accelerators import bvh
from renderer.accelerators.bvh import Bvh
from renderer.accelerators.discs import Discs, discs_of
from renderer.shapes import Family
from renderer.shapes.triangles import Triangles

MAX_UNTREED_TRIANGLES = 32
"""Families of at most so many triangles have no tree: culling by block is cheaper."""

KEPT_TREES = 4
"""Families whose trees a process keeps, the last ones used."""

Value = TypeVar("Value")


@dataclass(frozen=True, slots=True, eq=False)
class Tree(Bvh):
    """A tree of triangles.

    Attributes
    ----------
    discs : tuple of Discs
        Around the leaves, and around the nodes above them where there are any.
    """

    discs: tuple[Discs, ...]


class Kept(Generic[Value]):
    """Cache of trees: of all families in use, and of the last ones by content. Thread-safe."""

    def __init__(self, make: Callable[[Triangles], Value]) -> None:
        self._make = make
        self._lock = threading.Lock()
        self._alive: weakref.WeakKeyDictionary[Triangles, Value] = weakref.WeakKeyDictionary()
        self._values: OrderedDict[bytes, Value] = OrderedDict()

    def __call__(self, family: Triangles) -> Value:
        """The value of a family, made on first use."""
        with self._lock:
            if family in self._alive:
                return self._alive[family]
        value = self._by_content(family)
        with self._lock:
            return self._alive.setdefault(family, value)

    def forget(self) -> None:
        """Keep what is in use alone."""
        with self._lock:
            self._values.clear()

    def _by_content(self, family: Triangles) -> Value:
        key = hashlib.sha256(np.ascontiguousarray(family.vertices).data)
        key.update(np.ascontiguousarray(family.numbers).data)
        name = key.digest()
        with self._lock:
            if name in self._values:
                self._values.move_to_end(name)
                return self._values[name]
        # Without the lock: others do not wait for a large mesh. Two threads may make the same value.
        value = self._make(family)
        with self._lock:
            self._values[name] = value
            while len(self._values) > KEPT_TREES:
                self._values.popitem(last=False)
        return value


def in_tree(family: Family) -> TypeGuard[Triangles]:
    """Whether a family is intersected through a tree."""
    return isinstance(family, Triangles) and family.numbers.size > MAX_UNTREED_TRIANGLES


def build(family: Triangles) -> Tree:
    """The tree of a family."""
    tree = bvh.build(family.vertices.min(axis=0), family.vertices.max(axis=0))
    items, discs = tree.items, []
    for level in reversed(tree.levels[-2:]):
        discs.append(discs_of(family, items, *level.boxes(np.arange(items.shape[0]))))
        items = items.reshape(-1, level.children * items.shape[1])
    return Tree(tree.levels, tree.items, tuple(discs))


_trees = Kept(build)


def forget_trees() -> None:
    """Give back the memory of the trees that no plan uses any more."""
    _trees.forget()


def tree_of(family: Triangles) -> Tree:
    """The tree of a family; one for the same vertices is used again."""
    return _trees(family)
