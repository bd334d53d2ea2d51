import base64
import json
import struct
from typing import Any

import numpy as np
import pytest

from service.converting.errors import ConversionError
from tests.service.converting.conftest import Convert, noted

EPS = float(np.finfo(float).eps)
TRIANGLE = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]


class Made:
    """A glTF document that is built piece by piece."""

    def __init__(self) -> None:
        self.binary = b""
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "a test"},
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
        }

    def view(self, content: bytes) -> int:
        self.document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(content)}
        )
        self.binary += content + b"\0" * (-len(content) % 4)
        return len(self.document["bufferViews"]) - 1

    def accessor(self, rows: Any, kind: type = np.float32, **more: Any) -> int:
        values = np.asarray(rows, dtype=kind)
        codes = {np.float32: 5126, np.uint16: 5123, np.uint8: 5121, np.uint32: 5125}
        self.document["accessors"].append(
            {
                "bufferView": self.view(values.tobytes()),
                "componentType": codes[kind],
                "count": len(values),
                "type": "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}",
                **more,
            }
        )
        return len(self.document["accessors"]) - 1

    def mesh(self, positions: Any = TRIANGLE, indices: Any = (0, 1, 2), **more: Any) -> int:
        attributes = {"POSITION": self.accessor(positions)} | more.pop("attributes", {})
        primitive = {"attributes": attributes, "indices": self.accessor(indices, np.uint16), **more}
        self.document["meshes"].append({"primitives": [primitive]})
        return len(self.document["meshes"]) - 1

    def node(self, **fields: Any) -> int:
        self.document["nodes"].append(fields)
        return len(self.document["nodes"]) - 1

    def glb(self) -> bytes:
        text = json.dumps(self.document | {"buffers": [{"byteLength": len(self.binary)}]}).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        chunks += struct.pack("<II", len(self.binary), 0x004E4942) + self.binary
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def gltf(self, uri: str) -> bytes:
        buffers = [{"uri": uri, "byteLength": len(self.binary)}]
        return json.dumps(self.document | {"buffers": buffers}, indent=1).encode()


@pytest.fixture
def made() -> Made:
    """A document with one triangle, not yet placed."""
    document = Made()
    document.mesh()
    return document


def statements(content: bytes, word: str) -> list[tuple[float, ...]]:
    lines = [line.split() for line in content.decode().splitlines()]
    return [tuple(map(float, words[1:])) for words in lines if words[0] == word]


def vertices_of(converted: Convert, made: Made) -> list[tuple[float, ...]]:
    (content,) = converted("m.glb", made.glb()).files.values()
    return statements(content, "v")


def test_triangle(converted: Convert, made: Made) -> None:
    made.node(mesh=0)
    conversion = converted("m.glb", made.glb())
    assert conversion.files == {"m-default.obj": b"v 0.0 0.0 0.0\nv 1.0 0.0 0.0\nv 0.0 1.0 0.0\nf 1 2 3\n"}
    assert [shape["asset"] for shape in conversion.document["shapes"]] == ["m-default.obj"]
    assert conversion.document["lights"][0]["type"] == "rectangle"
    assert len([note for note in conversion.assumptions if not note.place]) == 3


def test_node_transforms(converted: Convert, made: Made) -> None:
    half = np.sqrt(0.5)
    child = made.node(mesh=0, scale=[2, 3, 4], rotation=[0, 0, half, half], translation=[10, 0, 0])
    made.node(children=[child], translation=[0, 0, 5])
    # A quarter turn about z takes x to y and y to -x.
    expected = [(10, 0, 5), (10, 2, 5), (7, 0, 5)]
    np.testing.assert_allclose(vertices_of(converted, made), expected, rtol=0, atol=16 * 10 * EPS)


def test_matrix_is_column_major(converted: Convert, made: Made) -> None:
    made.node(mesh=0, matrix=[0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1])
    assert vertices_of(converted, made) == [(7, 8, 9), (7, 9, 9), (6, 8, 9)]


def test_normalised_bytes(converted: Convert) -> None:
    made = Made()
    uv = made.accessor([(0, 255), (255, 0), (51, 0)], np.uint8, normalized=True)
    made.node(mesh=made.mesh(attributes={"TEXCOORD_0": uv}))
    (content,) = converted("m.glb", made.glb()).files.values()
    assert statements(content, "vt") == [(0, 0), (1, 1), (51 / 255, 1)]


def test_mirrored_mesh_keeps_its_outside(converted: Convert, made: Made) -> None:
    made.node(mesh=0, scale=[-1, 1, 1])
    (content,) = converted("m.glb", made.glb()).files.values()
    order = [int(number) - 1 for number in statements(content, "f")[0]]
    a, b, c = np.array(statements(content, "v"))[order]
    # The outside of the triangle is towards z before and after mirroring in x.
    assert np.cross(b - a, c - a)[2] > 0


def test_texture_coordinates(converted: Convert) -> None:
    made = Made()
    uv = made.accessor([(0, 0), (0.25, 0), (0, 0.75)])
    made.node(mesh=made.mesh(attributes={"TEXCOORD_0": uv}))
    (content,) = converted("m.glb", made.glb()).files.values()
    assert statements(content, "vt") == [(0, 1), (0.25, 1), (0, 0.25)]


@pytest.mark.parametrize(
    ("mode", "faces"), [(4, [(0, 1, 2)]), (5, [(0, 1, 2), (2, 1, 3)]), (6, [(0, 1, 2), (0, 2, 3)])]
)
def test_strips_and_fans(converted: Convert, mode: int, faces: list[tuple[int, ...]]) -> None:
    made = Made()
    square = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]
    made.node(mesh=made.mesh(square, (0, 1, 2, 3), mode=mode))
    (content,) = converted("m.glb", made.glb()).files.values()
    places = statements(content, "v")
    found = [tuple(places[int(number) - 1] for number in face) for face in statements(content, "f")]
    # As turning the corners of a triangle changes nothing, its smallest number comes first.
    assert [turned(face) for face in found] == [turned(tuple(square[n] for n in face)) for face in faces]


def turned(face: tuple[Any, ...]) -> tuple[Any, ...]:
    first = face.index(min(face))
    return face[first:] + face[:first]


@pytest.mark.parametrize("mirrored", [False, True])
def test_other_tangents_are_noted(converted: Convert, mirrored: bool) -> None:
    # u grows along x, or against it; v counts from the top of the picture, so that it grows along y.
    u = -1 if mirrored else 1
    for tangent, is_fine in (((u, 0, 0, u), True), ((u, 0, 0, -u), False), ((-u, 0, 0, u), False)):
        made = Made()
        attributes = {
            "TEXCOORD_0": made.accessor([(0, 1), (u, 1), (0, 0)]),
            "TANGENT": made.accessor([tangent] * 3),
        }
        made.node(mesh=made.mesh(attributes=attributes))
        left_out = noted(converted("m.glb", made.glb()), "left_out")
        assert left_out.keys() == (set() if is_fine else {"/meshes/0/primitives/0/attributes/TANGENT"})


def test_first_camera(converted: Convert, made: Made) -> None:
    made.node(mesh=0)
    made.document["cameras"] = [
        {"type": "perspective", "perspective": {"yfov": np.pi / 3, "aspectRatio": 1.5, "znear": 0.1}}
    ]
    made.node(camera=0, translation=[0, 0, 4])
    made.node(camera=0, translation=[9, 9, 9])
    conversion = converted("m.glb", made.glb())
    camera = conversion.document["camera"]
    assert camera["vertical_fov"] == pytest.approx(60, rel=4 * EPS)
    assert (camera["width"], camera["height"]) == (768, 512)
    assert (camera["position"], camera["up"]) == ([0, 0, 4], [0, 1, 0])
    # It looks along -z, at a point as far away as the middle of the mesh, which lies in z = 0.
    assert camera["look_at"] == [0, 0, 0]
    assert noted(conversion, "left_out") == {"/nodes/2/camera": "Only the first camera is used."}


def test_lights(converted: Convert, made: Made) -> None:
    made.node(mesh=0)
    lights = [
        {"type": "point", "intensity": np.pi, "color": [1, 0.5, 0]},
        {"type": "directional", "intensity": np.pi / 4},
        {"type": "spot", "intensity": np.pi, "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.5}},
        {"type": "spot"},
        # Half pi in float32 is a little more.
        {"type": "spot", "spot": dict.fromkeys(("innerConeAngle", "outerConeAngle"), 1.5707964)},
    ]
    made.document["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    half = np.sqrt(0.5)
    for number in range(5):
        made.node(
            extensions={"KHR_lights_punctual": {"light": number}},
            translation=[0, 0, 8],
            rotation=[-half, 0, 0, half],
        )
    conversion = converted("m.glb", made.glb())
    point, sun, *spots = conversion.document["lights"]
    assert (point["position"], point["falloff"]) == ([0, 0, 8], "physical")
    assert point["color"] == pytest.approx([1, 0.5, 0], rel=4 * EPS)
    # A light shines along -z of its node; minus a quarter turn about x takes -z to -y.
    assert sun["direction"] == pytest.approx([0, -1, 0], abs=4 * EPS)
    assert sun["color"] == pytest.approx([0.25] * 3, rel=4 * EPS)
    for spot in spots:
        assert (spot["type"], spot["position"], spot["falloff"]) == ("spot", [0, 0, 8], "physical")
        assert spot["direction"] == pytest.approx([0, -1, 0], abs=4 * EPS)
    assert spots[0]["color"] == pytest.approx([1] * 3, rel=4 * EPS)
    angles = [[spot["inner_angle"], spot["outer_angle"]] for spot in spots]
    assert angles[0] == pytest.approx([np.degrees(0.25), np.degrees(0.5)], rel=4 * EPS)
    assert angles[1:] == [[0, 45], [pytest.approx(89.1), 90]]
    narrowed = [place for place in noted(conversion, "assumed") if place.endswith("/spot")]
    assert narrowed == ["/extensions/KHR_lights_punctual/lights/4/spot"]
    assert "ambient" not in conversion.document


@pytest.mark.parametrize(("intensity", "stops"), [(1, 0), (8, -3), (1000, -9.97)])
def test_bright_lights_set_the_exposure(
    converted: Convert, made: Made, intensity: float, stops: float
) -> None:
    made.node(mesh=0)
    lights = [{"type": "directional", "intensity": np.pi * intensity}]
    made.document["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    made.node(extensions={"KHR_lights_punctual": {"light": 0}})
    scene = converted("m.glb", made.glb()).document
    assert scene.get("display", {"exposure": 0})["exposure"] == stops


def test_buffers_beside_and_inside(converted: Convert, made: Made) -> None:
    made.node(mesh=0)
    data = "data:application/octet-stream;base64," + base64.b64encode(made.binary).decode()
    own = converted("m.gltf", made.gltf(data)).files
    beside = converted("m.gltf", made.gltf("the%20numbers.bin"), **{"the numbers.bin": made.binary}).files
    assert own == beside == converted("m.glb", made.glb()).files


WRONG = {
    "/nodes/0/mesh": lambda document: document["nodes"][0].update(mesh=7),
    "/scene": lambda document: document.update(scenes=[{"nodes": [0]}], scene=3),
    "/scenes/0/nodes/1": lambda document: document.update(scenes=[{"nodes": [0, 0]}]),
    "/nodes/0/children/0": lambda document: document.update(
        scenes=[{"nodes": [0]}], nodes=[{"mesh": 0, "children": [0]}]
    ),
    "/accessors/0": lambda document: document["accessors"][0].update(count=10**6),
    "/accessors/1": lambda document: document["accessors"][1].update(sparse={"count": 1}),
    "/bufferViews/0": lambda document: document["bufferViews"][0].update(byteLength=10**6),
    "/bufferViews/0/buffer": lambda document: document["bufferViews"][0].update(buffer=2),
    "/meshes/0/primitives/0": lambda document: document["accessors"][0].update(count=2),
    "/meshes/0/primitives/0/attributes": lambda document: document["meshes"][0]["primitives"][0].update(
        attributes={}
    ),
    "/meshes": lambda document: document["meshes"][0]["primitives"][0].update(material=1),
    "/extensionsRequired/0": lambda document: document.update(
        extensionsRequired=["KHR_draco_mesh_compression"]
    ),
    "/asset/version": lambda document: document["asset"].update(version="1.0"),
    "/nodes/0/matrix": lambda document: document["nodes"][0].update(matrix=[1, 0]),
    "/materials/0/pbrMetallicRoughness/roughnessFactor": lambda document: document.update(
        materials=[{"pbrMetallicRoughness": {"roughnessFactor": 2}}]
    ),
    "/accessors/0/componentType": lambda document: document["accessors"][0].pop("componentType"),
}


@pytest.mark.parametrize("pointer", WRONG)
def test_problems_are_located(converted: Convert, pointer: str) -> None:
    made = Made()
    made.node(mesh=made.mesh())
    WRONG[pointer](made.document)
    with pytest.raises(ConversionError) as caught:
        converted("m.glb", made.glb())
    # A missing field is reported at the object that lacks it.
    place = pointer.removesuffix("/componentType")
    assert [problem.pointer for problem in caught.value.problems] == [place]
    assert caught.value.problems[0].detail.endswith(".")
