"""Many shapes are built together, a kind at a time: each is what it is alone, to the bit."""

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

import renderer
from renderer.shapes import Family, displacement, meshes
from tests.documents import Json, camera, ellipsoid, mesh, phong, rectangle, scene, sphere, triangle
from tests.pictures import pictures
from tests.pictures.parts import Files, png

FILES = Files(
    {
        "bumps.png": png(pictures.bumps()),
        "bare.obj": b"v -1 0 0\nv 1 0.2 0\nv 0 1 0.5\nv 0 0.3 -1\nf 1 2 3\nf 1 4 2\n",
        "mapped.obj": b"v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1 2/2 3/3\n",
    }
)
UVS = [[0.1, 0.2], [0.9, 0.3], [0.4, 0.8], [0.2, 0.7]]
MATERIALS = ["plain", "moved", "moved less"]


def solid(chosen: np.random.Generator, **more: Any) -> Json:
    """Four vertices, two of them in one place, and a triangle without area if it is not turned."""
    vertices = [*chosen.uniform(-1, 1, (3, 3)), [0, 0, 0]]
    vertices[1] = vertices[0] / 3
    return mesh([*vertices, vertices[0]], [[0, 1, 2], [4, 2, 1], [0, 1, 3], [2, 3, 4]], **more)


def placed(chosen: np.random.Generator) -> Json:
    turn = {"axis": chosen.uniform(-1, 1, 3).tolist(), "degrees": chosen.uniform(-400, 400)}
    scale = (chosen.uniform(0.2, 1, 3) * chosen.choice([-1, 1], 3)).tolist()
    far = {"translate": chosen.uniform(-99, 99, 3).tolist()}  # those in one place would be joined
    return far | {
        name: value for name, value in {"scale": scale, "rotate": turn}.items() if chosen.random() < 0.6
    }


def shapes_of(chosen: np.random.Generator) -> list[Json]:
    """One of each kind and form, in any order."""
    corners, other, third = (chosen.uniform(-1, 1, (3, 3)) + chosen.uniform(-99, 99, 3) for _ in range(3))
    center, ball = chosen.uniform(-99, 99, (2, 3))
    axes = np.linalg.qr(chosen.normal(size=(3, 3)))[0] * chosen.uniform(0.3, 1, (3, 1))
    facing = {"normal": axes[0].tolist(), "tangent": [0.3, 0.2, 0.1], "size": [0.5, 0.7]}
    shapes = [
        triangle(*corners),
        triangle(*other, normals=chosen.uniform(0.1, 1, (3, 3)), uvs=UVS[:3]),
        triangle(third[0], third[1], third[0] + 3 * (third[1] - third[0])),
        rectangle(center, axes[0], axes[1]),
        {"type": "rectangle", "center": ball.tolist(), **facing},
        ellipsoid(center, *axes),
        sphere(ball, 0.4),
        solid(chosen, smooth=True, **placed(chosen)),
        solid(chosen, uvs=[*UVS, UVS[0]], **placed(chosen)),
        {"type": "mesh", "asset": "bare.obj", "smooth": True, **placed(chosen)},
        {"type": "mesh", "asset": "mapped.obj", **placed(chosen)},
    ]
    return [shapes[i] | {"material": str(chosen.choice(MATERIALS))} for i in chosen.permutation(len(shapes))]


def families_of(shapes: list[Json]) -> tuple[Family, ...]:
    moved = {"displacement_map": "bumps", "displacement_height": 0.1}
    document = scene(
        *shapes,
        camera=camera(position=[0, 0, 500], look_at=[0, 0, 0], width=300, height=400),
        textures={"bumps": {"type": "image", "asset": "bumps.png"}},
        materials={
            "plain": phong(),
            "moved": phong(**moved),
            "moved less": phong(**moved | {"displacement_height": -0.05}),
        },
    )
    loaded = renderer.load_scene(document, assets=FILES)
    return renderer.compile_scene(loaded).geometry.families


def arrays_of(family: Family) -> dict[str, Any]:
    names = {item.name for item in fields(family)} - {"kind", "numbers"}
    return {name: getattr(family, name) for name in names}


@pytest.mark.parametrize("portion", [1, 1 << 14], ids=["in portions", "together"])
def test_shapes_of_a_crowd_are_what_they_are_alone(portion: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (meshes, displacement):
        monkeypatch.setattr(module, "TRIANGLES_AT_ONCE", portion)
    chosen = np.random.default_rng(3)
    shapes = [shape for _ in range(6) for shape in shapes_of(chosen)]
    together = families_of(shapes)
    for number, shape in enumerate(shapes):
        found = [part for family in together if (part := family.part(family.numbers == number)).numbers.size]
        alone = families_of([shape])
        assert [family.kind for family in found] == [family.kind for family in alone]
        for one, other in zip(found, alone, strict=True):
            for name, values in arrays_of(one).items():
                np.testing.assert_array_equal(values, arrays_of(other)[name], err_msg=f"{name} of {shape}")
