"""Meshes: triangles without area, and files that are missing."""

import numpy as np
import pytest

import renderer
from tests.documents import Json, bulb, mesh, phong, rectangle, sampled, scene
from tests.pictures.parts import plan_of, png

FLOOR = rectangle([-4, 0, -4], [0, 0, 8], [8, 0, 0])
FILES = {"line.obj": b"v 0 0 0\nv 1 1 1\nv 3 3 3\nf 1 2 3\nf 3 1 2\n"}
TURN = {"axis": [0, 1, 0], "degrees": 90}
FROM_FILE: Json = {"type": "mesh", "asset": "line.obj", "material": "plain", "rotate": TURN}
INLINE = mesh([[0, 0, 0], [1, 1, 1], [3, 3, 3]], [[0, 1, 2], [0, 0, 1]])
ROOF = mesh(
    [[-1, 1, 0], [1, 1, 0], [0, 2, 0], [0, 1, 1], [3, 1, 0]], [[0, 1, 4], [0, 1, 2], [0, 1, 3]]
)  # the first has no area


def drawn(*shapes: Json) -> renderer.RenderPlan:
    return plan_of(scene(*shapes, lights=[bulb([1, 4, 3])], sampling=sampled(4)), files=FILES)


@pytest.mark.parametrize("flat", [FROM_FILE, INLINE], ids=["file", "inline"])
@pytest.mark.parametrize("others", [[FLOOR], [FLOOR, ROOF], []], ids=["floor", "floor and roof", "nothing"])
def test_mesh_without_area_is_left_out(flat: Json, others: list[Json]) -> None:
    """The picture is that of the other shapes."""
    plan = drawn(*others, flat)
    found = [(item.effect, item.pointers) for item in plan.left_out if "area" in item.reason]
    assert found == [("shapes.mesh", (f"/shapes/{len(others)}",))]
    result, bare = renderer.render(plan), renderer.render(drawn(*others))
    assert result.image.tobytes() == bare.image.tobytes()
    assert result.report["rays"] == bare.report["rays"]
    dropped, before = (r.report["numerics"]["degenerate_dropped"] for r in (result, bare))
    assert dropped == before + 2


def test_mesh_triangles_keep_their_numbers() -> None:
    for shapes in ([FLOOR, ROOF, FROM_FILE], [FLOOR, FROM_FILE, ROOF], [FLOOR, INLINE, ROOF, FROM_FILE]):
        hits = renderer.trace(drawn(*shapes), [[0, 1.5, 5], [0, 5, 0.5]], [[0, 0, -1], [0, -1, 0]])
        assert hits.shape.tolist() == [shapes.index(ROOF)] * 2
        assert hits.primitive.tolist() == [1, 2]


def test_copies_of_a_triangle_change_nothing() -> None:
    vertices, (line, front, side) = ROOF["vertices"], ROOF["triangles"]
    copied = mesh(vertices, [line, front, front, side, side, front, line])
    result, bare = (renderer.render(drawn(FLOOR, shape)) for shape in (copied, ROOF))
    assert result.image.tobytes() == bare.image.tobytes()
    assert result.report["rays"] == bare.report["rays"]
    # Those of another mesh stay: each has the one without area alone.
    twice = renderer.render(drawn(FLOOR, ROOF, ROOF))
    assert [r.report["numerics"]["degenerate_dropped"] for r in (result, bare, twice)] == [5, 1, 2]
    hits = renderer.trace(drawn(FLOOR, copied), [[0, 1.5, 5], [0, 5, 0.5]], [[0, 0, -1], [0, -1, 0]])
    assert hits.primitive.tolist() == [1, 3]


@pytest.mark.parametrize("times", [2, 20], ids=["few", "in a tree"])
def test_copies_of_a_triangle_keep_the_target(times: int) -> None:
    copied = drawn(FLOOR, mesh(ROOF["vertices"], times * ROOF["triangles"]))
    samples = {"pattern": "sobol", "samples": 256}
    true = renderer.render(copied, {"mode": "fixed", "antialiasing": samples}).image
    result = renderer.render(copied, {"mode": "target", "error": 2 / 255})
    assert np.sqrt(np.mean((np.clip(result.image, 0, 1) - np.clip(true, 0, 1)) ** 2)) <= 3 / 255


def test_displaced_mesh_without_its_file_is_a_problem() -> None:
    document = scene(
        {"type": "mesh", "asset": "lost.obj", "material": "moved"},
        textures={"bumps": {"type": "image", "asset": "bumps.png"}},
        materials={"moved": phong(displacement_map="bumps", displacement_height=0.1)},
    )
    with pytest.raises(renderer.SceneError) as caught:
        plan_of(document, files={"bumps.png": png(np.full((1, 1, 3), 128, np.uint8))})
    assert [(each.pointer, each.code) for each in caught.value.errors] == [("/shapes/0/asset", "asset")]
