"""Which flat shapes overlap in one plane, so that rays have to be given the first of them."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from renderer.accelerators.trees import in_tree
from renderer.interaction import RayStage
from renderer.math.arrays import Integers, Masks
from renderer.plan import cost
from renderer.plan.cost import COSTS
from renderer.plan.request import Request
from renderer.plan.shapes import meeting_of
from renderer.shapes.overlaps import First, Overlaps, overlapping, places_of
from renderer.shapes.polygons import FlatFamily
from renderer.shapes.triangles import Triangles


def stages(request: Request) -> list[RayStage]:
    """What comes first of flat shapes that overlap in one plane, unless all of these are in trees."""
    flat = [family for family in request.families if isinstance(family, FlatFamily)]
    firsts = [first for family in flat if not in_tree(family) for first in _firsts(family, flat)]
    if not firsts:
        return []
    request.listing.add(
        "shapes in one plane",
        "shapes",
        "of those that overlap the first of the scene is met",
        ("/shapes",),
        cost.seconds(request.rays, COSTS.shape * cost.met(len(firsts))),
    )
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
        yield First(partial(family.meet, int(shape)), _marked(before[first == shape], begins[-1]))


def _trees_first(tree: Triangles, shapes: Integers, triangles: Integers, count: int) -> Iterator[First]:
    """Triangles in trees that come before shapes met one by one, of pairs of both (P,)."""
    for shape in np.unique(shapes):
        part = tree.part(np.unique(triangles[shapes == shape]))
        yield First(meeting_of(part).run, _marked(shape, count))


def _marked(places: Integers, count: int) -> Masks:
    marks = np.zeros(count + 1, dtype=bool)
    marks[places] = True
    return marks
