"""Meshes read from files."""

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from trimesh.visual import TextureVisuals

import renderer
from renderer.meshes import files as mesh_files
from renderer.meshes.files import announced, read_mesh
from renderer.shapes import meshes
from schemas.errors import SceneError
from schemas.limits import Limits
from schemas.reading import read_scene
from tests.documents import Json, scene
from tests.pictures.parts import Files, image_of, plan_of
from tests.pictures.test_meshes import FACES, FLOOR, VERTICES, lit, mesh, mesh_file

ROOT = Path(__file__).parents[2]


def solid() -> trimesh.Trimesh:
    return trimesh.Trimesh(VERTICES, FACES, process=False)


def textured() -> trimesh.Trimesh:
    uv = np.random.default_rng(1).uniform(size=(len(VERTICES), 2))
    return trimesh.Trimesh(VERTICES, FACES, process=False, visual=TextureVisuals(uv=uv))


def ascii_ply(vertices: Any, faces: Any) -> bytes:
    lines = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(repr, map(float, vertex))) for vertex in vertices]
    lines += [" ".join(map(str, (len(face), *face))) for face in faces]
    return "\n".join(lines).encode() + b"\n"


def obj(vertices: Any, faces: Any, before: str = "") -> bytes:
    lines = ["v " + " ".join(map(repr, map(float, vertex))) for vertex in vertices]
    lines += ["f " + " ".join(str(int(i) + 1) for i in face) for face in faces]
    return (before + "\n".join(lines) + "\n").encode()


FILES = {
    "obj": lambda: obj(VERTICES, FACES),
    "ply ascii": lambda: ascii_ply(VERTICES, FACES),
    "ply binary": lambda: solid().export(file_type="ply", encoding="binary"),
    "glb": lambda: solid().export(file_type="glb"),
}


@pytest.mark.parametrize("kind", FILES)
def test_file_is_read_as_written(kind: str) -> None:
    vertices, triangles, texture = read_mesh("m", Files(m=FILES[kind]()))
    assert texture is None
    assert vertices.shape == (3, len(VERTICES))
    exact = kind in {"obj", "ply ascii"}
    np.testing.assert_allclose(vertices.T, VERTICES, rtol=0, atol=0 if exact else 1e-7)
    np.testing.assert_array_equal(triangles.T, FACES)


@pytest.mark.parametrize("kind", ["obj", "ply ascii"])
def test_file_equals_the_mesh_in_the_scene(kind: str) -> None:
    expected = image_of(lit(FLOOR, mesh(smooth=True)))
    found = image_of(lit(FLOOR, mesh_file("m", smooth=True)), files={"m": FILES[kind]()})
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("kind", ["obj", "glb"])
def test_texture_coordinates(kind: str) -> None:
    content = textured().export(file_type=kind)
    content = content.encode() if isinstance(content, str) else content
    vertices, triangles, texture = read_mesh("m", Files(m=content))
    assert texture is not None
    assert texture.shape == (2, vertices.shape[1])
    np.testing.assert_allclose(texture[:, triangles].T, textured().visual.uv[FACES], atol=1e-6)


def test_quadrilaterals() -> None:
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    for content in (obj(square, [[0, 1, 2, 3]]), ascii_ply(square, [[0, 1, 2, 3]])):
        _, triangles, _ = read_mesh("m", Files(m=content))
        assert triangles.shape == (3, 2)


def test_file_placed_many_times() -> None:
    reads = []

    class Counted(Files):
        def read(self, name: str) -> bytes:
            reads.append(name)
            return super().read(name)

    shapes = [mesh_file("m", translate=[x, 0, 0]) for x in (-2, 0, 2)]
    document = read_scene(scene(*shapes))[0]
    family = meshes.build([0, 1, 2], document.shapes, Counted(m=FILES["obj"]()))
    assert reads == ["m"]
    assert family.numbers.tolist() == np.repeat([0, 1, 2], len(FACES)).tolist()


def glb(document: Json, binary: bytes = b"") -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    tail = struct.pack("<II", len(binary), 0x004E4942) + binary if binary else b""
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(tail), len(text), 0x4E4F534A)
    return head + text + tail


def changed_glb(**changes: Any) -> bytes:
    content = solid().export(file_type="glb")
    length = struct.unpack_from("<I", content, 12)[0]
    document = json.loads(content[20 : 20 + length])
    return glb({**document, **changes}, content[20 + length + 8 :])


def refusal(content: bytes, **more: Any) -> str:
    with pytest.raises(SceneError) as caught:
        plan_of(scene(FLOOR, mesh_file("m", **more)), files={"m": content})
    (problem,) = caught.value.errors
    assert problem.pointer == "/shapes/1/asset"
    return problem.detail


class Watched(Files):
    def read(self, name: str) -> bytes:
        assert name == "m", f"{name} was opened"
        return super().read(name)


def test_named_files_are_not_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd picture.png\n")
    named = obj(VERTICES, FACES, before="mtllib m.mtl\nusemtl a\n")
    pictures = changed_glb(images=[{"uri": "file:///etc/passwd"}, {"uri": "http://127.0.0.1:9/x.png"}])
    comment = FILES["ply ascii"]().replace(b"end_header", b"comment TextureFile picture.png\nend_header", 1)
    opened: list[str] = []
    real = io.open

    def watched(file: Any, *args: Any, **options: Any) -> Any:
        opened.append(str(file))
        return real(file, *args, **options)

    read_mesh("m", Watched(m=named))
    monkeypatch.setattr("builtins.open", watched)
    for content in (named, pictures, comment):
        _, triangles, _ = read_mesh("m", Watched(m=content))
        assert triangles.shape[1] == len(FACES)
    assert [name for name in opened if "m.mtl" in name or "picture" in name or "passwd" in name] == []


DAMAGED = {
    "no mesh": b"\x89PNG\r\n\x1a\n",
    "empty": b"",
    "blank lines": b"\n" * 200_000,
    "half a ply": FILES["ply binary"]()[:3000],
    "ply without a body": ascii_ply(VERTICES, FACES).split(b"end_header")[0],
    "half a glb": FILES["glb"]()[:3000],
    "glb of nothing": glb({}),
    "glb of lists": glb({"meshes": [[]], "accessors": [], "buffers": [], "nodes": [{"mesh": 0}]}),
    "glb header alone": b"glTF",
    "obj of words": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf one two three\n",
    "points alone": b"v 0 0 0\nv 1 0 0\n",
    "ply of points": ascii_ply(VERTICES, []),
    "vertex beyond": ascii_ply(VERTICES, [[0, 1, 9999]]),
    "vertex beyond in obj": obj(VERTICES, [[0, 1, 9999]]),
    "no number": ascii_ply([[0, 0, 0], [float("nan"), 0, 0], [0, 1, 0]], [[0, 1, 2]]),
    "infinite": obj([[0, 0, 0], [float("inf"), 0, 0], [0, 1, 0]], [[0, 1, 2]]),
    "too far": ascii_ply([[0, 0, 0], [1e300, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
}


@pytest.mark.parametrize("content", DAMAGED.values(), ids=DAMAGED)
def test_damaged_file(content: bytes) -> None:
    assert refusal(content).endswith((".", ")."))


def test_missing_file() -> None:
    with pytest.raises(SceneError) as caught:
        plan_of(scene(mesh_file("m")))
    assert [problem.pointer for problem in caught.value.errors] == ["/shapes/0/asset"]


MAX_TRIANGLES = Limits().max_mesh_triangles
MANY = MAX_TRIANGLES + 1
NODE = {"mesh": 0}
HUGE = {
    "ply faces": ascii_ply(VERTICES, FACES).replace(f"face {len(FACES)}".encode(), f"face {MANY}".encode()),
    "ply vertices": FILES["ply binary"]().replace(
        f"vertex {len(VERTICES)}".encode(), f"vertex {MANY}".encode(), 1
    ),
    "obj": b"v 0 0 0\n" + b"\nf 1 1 1" * MANY,
    "glb": changed_glb(nodes=[NODE] * (MANY // len(FACES) + 1)),
    "zeros": changed_glb(
        accessors=[{"componentType": 5126, "count": 10**12, "type": "VEC3", "bufferView": 0}] * 2
    ),
}


@pytest.mark.parametrize("content", HUGE.values(), ids=HUGE)
def test_too_many_triangles(content: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    def unread(*_: Any) -> None:
        raise AssertionError("the file was read")

    for reader in ("read_obj", "read_ply", "read_glb"):
        monkeypatch.setattr(mesh_files, reader, unread)
    assert "Simplify it." in refusal(content)


def test_node_in_many_places() -> None:
    doubling = [{"children": [i + 1, i + 1]} for i in range(40)]
    assert "damaged" in refusal(changed_glb(nodes=[*doubling, NODE]))


def test_accessors_without_numbers() -> None:
    accessor = {"componentType": 5126, "count": 3, "type": "VEC3"}
    assert "sparse" in refusal(changed_glb(accessors=[accessor, accessor]))


def test_announced_triangles() -> None:
    assert announced(FILES["obj"]()) == len(FACES) - 1 or announced(FILES["obj"]()) == len(FACES)
    assert announced(FILES["ply binary"]()) == len(FACES)
    assert announced(FILES["glb"]()) == len(FACES)


@pytest.mark.slow
def test_limit_of_all_meshes() -> None:
    shapes = [mesh_file("m", translate=[float(i), 0, 0]) for i in range(3)]
    side = int((MAX_TRIANGLES / 2) ** 0.5) // 2
    faces = np.tile([0, 1, 2], (3 * side * side, 1))
    content = trimesh.Trimesh(VERTICES, faces, process=False).export(file_type="ply")
    assert MAX_TRIANGLES / 3 < len(faces) <= MAX_TRIANGLES / 2
    document = read_scene(scene(*shapes))[0]
    with pytest.raises(renderer.SceneError) as caught:
        plan_of(document.model_dump(mode="json", exclude_none=True), files={"m": content})
    assert [problem.pointer for problem in caught.value.errors] == ["/shapes/2/asset"]
