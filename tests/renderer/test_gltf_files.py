"""glTF files whose buffers lie beside them or inside them, and what is wrong with such files."""

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from renderer.assets import AssetError, FolderAssets
from renderer.meshes.files import announced, needs_other_files, read_mesh, self_contained
from service.converting.formats import convert
from tests.pictures.parts import Files
from tests.renderer.test_mesh_files import FACES, solid, textured
from tests.service.converting.test_gltf import TRIANGLE, Made


def with_buffers(made: Made, **buffer: Any) -> bytes:
    """The document as `.gltf`, its buffer described by some fields."""
    return json.dumps(made.document | {"buffers": [{"byteLength": len(made.binary)} | buffer]}).encode()


def placed(**more: Any) -> Made:
    """One triangle, in place."""
    made = Made()
    made.mesh(**more)
    made.node(mesh=0)
    return made


def folder_of(tmp_path: Path, **files: bytes) -> FolderAssets:
    for name, content in files.items():
        path = tmp_path / name.replace("__", "/")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return FolderAssets(tmp_path)


def written(mesh: trimesh.Trimesh) -> dict[str, bytes]:
    """The files that trimesh writes for a mesh: `model.gltf` and its buffers."""
    files = trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh))
    return {name: bytes(content) for name, content in files.items()}


@pytest.mark.parametrize("make", [solid, textured], ids=["plain", "textured"])
def test_gltf_with_its_buffers_equals_glb(make: Callable[[], trimesh.Trimesh]) -> None:
    files = written(make())
    assert len([name for name in files if name.endswith(".bin")]) > 1
    found = read_mesh("model.gltf", Files(files))
    expected = read_mesh("m", Files(m=make().export(file_type="glb")))
    for one, other in zip(found, expected, strict=True):
        assert (one is None) == (other is None)
        if one is not None:
            np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(found[1].T, FACES)


def test_data_uri() -> None:
    made = placed()
    for head in (
        "data:application/octet-stream;base64,",
        "data:application/gltf-buffer;base64,",
        "data:;base64,",
    ):
        content = with_buffers(made, uri=head + base64.b64encode(made.binary).decode())
        vertices, triangles, _ = read_mesh("m.gltf", Files({"m.gltf": content}))
        assert vertices.T.tolist() == np.array(TRIANGLE, dtype=float).tolist()
        assert triangles.T.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize(
    ("uri", "file"),
    [
        ("m.bin", "models__m.bin"),
        ("./m.bin", "models__m.bin"),
        ("two%20w%C3%B6rter.bin", "models__two wörter.bin"),
        ("parts/m.bin", "models__parts__m.bin"),
        ("parts\\m.bin", "models__parts__m.bin"),
        ("../m.bin", "m.bin"),
    ],
)
def test_buffers_beside_the_mesh(tmp_path: Path, uri: str, file: str) -> None:
    made = placed()
    assets = folder_of(tmp_path, **{"models__m.gltf": with_buffers(made, uri=uri), file: made.binary})
    assert read_mesh("models/m.gltf", assets)[1].shape == (3, 1)


AWAY = {
    "file:///etc/hostname": "by an address or an absolute path",
    "http://127.0.0.1:9/m.bin": "by an address or an absolute path",
    "//127.0.0.1/m.bin": "by an address or an absolute path",
    "/etc/hostname": "by an address or an absolute path",
    "%2Fetc%2Fhostname": "by an address or an absolute path",
    "C:\\m.bin": "by an address or an absolute path",
    "../../secret.bin": "outside the scene's folder by '..'",
    "%2e%2e/%2E%2E/secret.bin": "outside the scene's folder by '..'",
    "link.bin": "symbolic link on this path leads outside",
    "nowhere.bin": "is not there. Put it beside the mesh, or save the mesh as GLB.",
    "": "This is a folder",
    "data:application/octet-stream,plain": "not base64",
    "data:application/octet-stream;base64,####": "not base64",
}


@pytest.mark.parametrize(("uri", "detail"), AWAY.items(), ids=AWAY)
def test_buffers_outside_the_folder(tmp_path: Path, uri: str, detail: str) -> None:
    made = placed()
    (tmp_path / "secret.bin").write_bytes(made.binary)
    assets = folder_of(tmp_path / "scene", models__m=with_buffers(made, uri=uri))
    (tmp_path / "scene" / "models" / "link.bin").symlink_to(tmp_path / "secret.bin")
    with pytest.raises(AssetError) as caught:
        read_mesh("models/m", assets)
    assert detail in str(caught.value)


def changed(part: str, number: int, **fields: Any) -> Callable[[Made], None]:
    def change(made: Made) -> None:
        made.document[part][number] |= fields

    return change


def added(**fields: Any) -> Callable[[Made], None]:
    return lambda made: made.document.update(fields)


def quantised(made: Made) -> None:
    number = made.accessor([(0, 0), (65535, 0), (0, 65535)], np.uint16)
    made.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = number


def indexed(*numbers: int) -> Callable[[Made], None]:
    def change(made: Made) -> None:
        made.document["meshes"][0]["primitives"][0]["indices"] = made.accessor(numbers, np.uint16)

    return change


def at_place(x: float) -> Callable[[Made], None]:
    return changed("nodes", 0, translation=[x, 0, 0])


def coordinates(rows: Any) -> Callable[[Made], None]:
    def change(made: Made) -> None:
        made.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = made.accessor(rows)

    return change


SPARSE = {"count": 1, "indices": {"bufferView": 0, "componentType": 5123}, "values": {"bufferView": 0}}
WRONG: dict[str, tuple[Callable[[Made], None], str]] = {
    "draco": (added(extensionsRequired=["KHR_draco_mesh_compression"]), "compressed (Draco)"),
    "meshopt": (added(extensionsRequired=["EXT_meshopt_compression"]), "compressed (meshopt)"),
    "quantisation": (added(extensionsRequired=["KHR_mesh_quantization"]), "quantised"),
    "instances": (added(extensionsRequired=["EXT_mesh_gpu_instancing"]), "instances"),
    "short integers": (changed("accessors", 0, componentType=5122), "Its vertices are quantised"),
    "texture coordinates": (quantised, "Its texture coordinates are quantised"),
    "sparse": (changed("accessors", 0, sparse=SPARSE), "sparse"),
    "morph targets": (changed("meshes", 0, weights=[0, 0.5]), "morph targets"),
    "morphed node": (changed("nodes", 0, weights=[1]), "morph targets"),
    "version 1": (added(asset={"version": "1.0"}), "not glTF 2.0"),
    "short view": (changed("bufferViews", 0, byteLength=35), "do not fit into its bufferView of 35 bytes"),
    "view beyond": (changed("bufferViews", 0, byteOffset=40), "ends beyond its buffer of 44 bytes"),
    "view before": (changed("bufferViews", 0, byteOffset=-4), "ends beyond its buffer"),
    "stride": (changed("bufferViews", 0, byteStride=16), "do not fit"),
    "signed indices": (changed("accessors", 1, componentType=5122), "damaged"),
    "no accessor": (changed("meshes", 0, primitives=[{"attributes": {"POSITION": 9}}]), "damaged"),
    "no vertices": (changed("meshes", 0, primitives=[{"attributes": {}}]), "damaged"),
    "no such node": (changed("nodes", 0, mesh=7), "damaged"),
    "asset": (added(asset="wood.png"), "not glTF"),
    "vertex beyond": (indexed(0, 1, 3), "Primitive 0 of mesh 0 names the vertex 3"),
    "no number": (at_place(float("nan")), "Primitive 0 of mesh 0 has vertices that are not finite"),
    "too far": (
        changed("nodes", 0, scale=[1e308] * 3, children=[]),
        "Primitive 0 of mesh 0 has vertices that",
    ),
    "nowhere": (changed("nodes", 0, matrix=[10**400] * 16), "not finite"),
    "fewer coordinates": (coordinates([(0, 0), (1, 0)]), "2 pairs of texture coordinates for 3 vertices"),
    "odd coordinates": (coordinates([(0, 0), (1, 0), (0, 1e30)]), "first at its vertex 2"),
    "its own child": (added(scenes=[{"nodes": [0]}], nodes=[{"mesh": 0, "children": [0]}]), "damaged"),
}


@pytest.mark.parametrize(("change", "detail"), WRONG.values(), ids=WRONG)
def test_unread_geometry_is_refused(change: Callable[[Made], None], detail: str) -> None:
    made = placed()
    change(made)
    for content in (made.glb(), with_buffers(made, uri="m.bin")):
        with pytest.raises(AssetError) as caught:
            read_mesh("m", Files({"m": content, "m.bin": made.binary}))
        assert detail in str(caught.value)


PENTAGON = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0)]
ZIGZAG = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 2, 0)]
MODES = {
    "triangles, and two vertices of no triangle": (4, PENTAGON, (0, 1, 2, 2, 3), [1.0]),
    "strip": (5, ZIGZAG, (0, 1, 2, 3, 4), [0.5, 0.5, 0.5]),
    "fan": (6, PENTAGON, (0, 1, 2, 3, 4), [1.0, 1.5, 0.5]),
}


@pytest.mark.parametrize("case", MODES.values(), ids=MODES)
@pytest.mark.parametrize("scale", [[1, 1, 1], [-1, 1, 1], [2, -1, 1], [-1, -1, 1], [1, -1, -1]])
def test_modes_keep_their_outside(case: Any, scale: list[int], tmp_path: Path) -> None:
    mode, places, order, areas = case
    made = Made()
    made.node(mesh=made.mesh(places, order, mode=mode, attributes={"NORMAL": made.accessor([(0, 0, 1)] * 5)}))
    made.node(children=[0], scale=scale)
    # Points and lines beside them are no part of the surface.
    lines = [{"attributes": {"POSITION": made.accessor(places)}, "mode": other} for other in range(4)]
    made.document["meshes"][0]["primitives"] += lines
    file = tmp_path / "m.glb"
    file.write_bytes(made.glb())
    conversion = convert(file, root=tmp_path, folder=tmp_path)
    (written,) = conversion.files.values()
    for content in (made.glb(), written):
        vertices, triangles, texture = read_mesh("m", Files(m=content))
        a, b, c = (vertices[:, row].T for row in triangles)
        # An outside towards z is towards -z where z is mirrored.
        found = np.cross(b - a, c - a) / 2
        expected = np.array(areas) * abs(np.prod(scale)) * np.sign(scale[2])
        np.testing.assert_array_equal(found, [(0, 0, area) for area in expected])
        assert texture is None
    assert "smooth" not in conversion.document["shapes"][0]


@pytest.mark.parametrize("length", [1e-200, 0.5, 1e200])
def test_quaternion_of_any_length(length: float) -> None:
    made = placed()
    made.document["nodes"][0]["rotation"] = [0, 0, length, length]
    # A quarter turn about z takes x to y and y to -x.
    found = read_mesh("m", Files(m=made.glb()))[0].T
    np.testing.assert_allclose(found, [(0, 0, 0), (0, 1, 0), (-1, 0, 0)], rtol=0, atol=1e-15)


@pytest.mark.parametrize(("kind", "largest"), [(np.uint8, 255), (np.uint16, 65535)])
def test_primitive_without_texture_coordinates(kind: type, largest: int) -> None:
    made = Made()
    shares = made.accessor([(0, largest), (largest, 0), (0, 0)], kind, normalized=True)
    for number, attributes in enumerate(({}, {"TEXCOORD_0": shares}, {})):
        made.node(mesh=made.mesh(attributes=attributes), translation=[number, 0, 0])
    vertices, triangles, texture = read_mesh("m", Files(m=made.glb()))
    assert texture is not None
    by_place = {
        int(vertices[0, row[0]]): [tuple(texture[:, corner].tolist()) for corner in row]
        for row in triangles.T
    }
    bare = [(0, 0), (1, 0), (0, 1)]
    assert by_place == {0: bare, 1: [(0, 0), (1, 1), (0, 1)], 2: bare}
    del made.document["nodes"][1]
    assert read_mesh("m", Files(m=made.glb()))[2] is None


def test_buffer_without_bytes() -> None:
    with pytest.raises(AssetError, match="Buffer 0 of the mesh has no 'uri'"):
        read_mesh("m", Files(m=with_buffers(placed())))


def test_mesh_is_one_file_for_a_server() -> None:
    files = Files(written(textured()))
    content = files.read("model.gltf")
    alone = self_contained("model.gltf", content, files)
    assert alone.startswith(b"glTF")
    assert alone == self_contained("model.gltf", content, files)
    assert [needs_other_files(one, most=1000) for one in (content, alone)] == [True, False]
    assert announced(alone) == announced(content) == len(FACES)
    for one, other in zip(read_mesh("x", Files(x=alone)), read_mesh("model.gltf", files), strict=True):
        np.testing.assert_array_equal(one, other)
