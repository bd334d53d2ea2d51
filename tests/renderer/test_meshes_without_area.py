"""A mesh of which no triangle has an area is left out; the others keep their numbers."""

from typing import Any

import pytest

import renderer
from accuracy.hard_cases.documents import Json, bulb, rectangle, sampled, scene
from tests.pictures.parts import plan_of

FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
LINE = b"v 0 0 0\nv 1 1 1\nv 3 3 3\nf 1 2 3\nf 3 1 2\n"
FILES = {"line.obj": LINE}
FROM_FILE = {
    "type": "mesh",
    "asset": "line.obj",
    "material": "plain",
    "rotate": {"axis": [0, 1, 0], "degrees": 90},
}
WRITTEN = {
    "type": "mesh",
    "vertices": [[0, 0, 0], [1, 1, 1], [3, 3, 3]],
    "triangles": [[0, 1, 2], [0, 0, 1]],
    "material": "plain",
}
ROOF = {
    "type": "mesh",
    "vertices": [[-1, 1, 0], [1, 1, 0], [0, 2, 0], [0, 1, 1], [3, 1, 0]],
    "triangles": [[0, 1, 4], [0, 1, 2], [0, 1, 3]],
    "material": "plain",
}


def drawn(*shapes: Json) -> renderer.RenderPlan:
    return plan_of(scene(*shapes, lights=[bulb([1, 4, 3])], sampling=sampled(4)), files=FILES)


@pytest.mark.parametrize("flat", [FROM_FILE, WRITTEN], ids=["file", "written"])
@pytest.mark.parametrize("others", [[FLOOR], [FLOOR, ROOF], []], ids=["floor", "floor and roof", "nothing"])
def test_mesh_without_area_is_left_out(flat: dict[str, Any], others: list[Json]) -> None:
    plan = drawn(*others, flat)
    found = [(item.effect, item.pointers, item.reason) for item in plan.left_out if "area" in item.reason]
    assert found == [("shapes.mesh", (f"/shapes/{len(others)}",), "no triangle of it has an area")]
    result, bare = renderer.render(plan), renderer.render(drawn(*others))
    assert result.image.tobytes() == bare.image.tobytes()
    assert result.report["rays"] == bare.report["rays"]
    dropped, before = (r.report["numerics"]["degenerate_dropped"] for r in (result, bare))
    assert dropped == before + 2


def test_other_triangles_keep_their_numbers() -> None:
    """Of the roof's own three the first is flat and stays."""
    for shapes in ([FLOOR, ROOF, FROM_FILE], [FLOOR, FROM_FILE, ROOF], [FLOOR, WRITTEN, ROOF, FROM_FILE]):
        plan = drawn(*shapes)
        hits = renderer.trace(plan, [[0, 1.5, 5], [0, 5, 0.5]], [[0, 0, -1], [0, -1, 0]])
        assert hits.shape.tolist() == [shapes.index(ROOF)] * 2
        assert hits.primitive.tolist() == [1, 2]
