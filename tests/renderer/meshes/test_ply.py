"""PLY files, written by hand in every form in which the same mesh may come."""

import struct
from typing import Any

import numpy as np
import pytest
import trimesh

from renderer.assets import AssetError
from renderer.meshes.files import read_mesh
from tests.pictures.parts import Files

CODES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I"} | {
    "float": "f",
    "double": "d",
    "int32": "i",
    "uint8": "B",
    "float32": "f",
    "float64": "d",
}
FORMS = ("ascii", "binary_little_endian", "binary_big_endian")
Element = tuple[str, list[str], list[list[Any]]]
"""Name, properties as in a header, and rows of which a list is a list."""


def ply(form: str, *elements: Element, comments: tuple[str, ...] = (), newline: str = "\n") -> bytes:
    lines = ["ply", f"format {form} 1.0", *(f"comment {text}" for text in comments)]
    body = b""
    for name, properties, rows in elements:
        lines += [f"element {name} {len(rows)}", *(f"property {each}" for each in properties)]
        for row in rows:
            if form == "ascii":
                words = [[len(each), *each] if isinstance(each, list) else [each] for each in row]
                body += " ".join(repr(word) for some in words for word in some).encode() + newline.encode()
            else:
                order = "<" if "little" in form else ">"
                for each, words in zip(row, map(str.split, properties), strict=True):
                    if words[0] == "list":
                        body += struct.pack(order + CODES[words[1]], len(each))
                        body += struct.pack(f"{order}{len(each)}{CODES[words[2]]}", *each)
                    else:
                        body += struct.pack(order + CODES[words[0]], each)
    return newline.join([*lines, "end_header", ""]).encode() + body


def mesh_of(content: bytes) -> Any:
    return read_mesh("m.ply", Files({"m.ply": content}))


def area(content: bytes) -> float:
    """Sum of the areas of all triangles, which are turned upwards or count negative."""
    vertices, triangles, _ = mesh_of(content)
    a, b, c = (vertices[:, row].T for row in triangles)
    return float(np.cross(b - a, c - a)[:, 2].sum() / 2)


XYZ = [f"float {axis}" for axis in "xyz"]
FACE = ["list uchar int vertex_indices"]
GRID = [[float(x), float(y), 0.0] for y in range(3) for x in range(4)]
"""Vertices 0 to 3 in the first row, 4 to 7 above them, 8 to 11 above those."""
MIXED = [[[0, 1, 5, 4]], [[1, 2, 5]], [[2, 6, 5]], [[4, 5, 6, 10, 9, 8]]]
L_SHAPE = [[1, 3, 7, 6, 10, 9]]
"""Concave, of area 3; its fan from the first corner has 1 outside of it."""


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_faces_of_mixed_size_are_read(form: str, newline: str) -> None:
    vertices: Element = (
        "vertex",
        ["uchar red", "list ushort short near", *XYZ, "double confidence"],
        [[7, [1] * (i % 3), *place, 0.5] for i, place in enumerate(GRID)],
    )
    faces: Element = (
        "face",
        ["uchar flags", "list uint float weights", "list ushort uint vertex_index", "double quality"],
        [[255, [0.5] * i, *row, 1e300] for i, row in enumerate(MIXED)],
    )
    edges: Element = ("edge", ["int32 a", "int32 b"], [[0, 1], [1, 2]])
    cameras: Element = ("camera", ["list uint8 float64 view"], [[[1.0]], [[2.0, 3.0]]])
    for elements in ((cameras, vertices, faces, edges), (faces, edges, vertices, cameras)):
        found, triangles, texture = mesh_of(ply(form, *elements, newline=newline))
        assert found.T.tolist() == GRID
        assert triangles.T.tolist()[2:4] == [[1, 2, 5], [2, 6, 5]]
        assert texture is None
        assert area(ply(form, *elements, newline=newline)) == 4


@pytest.mark.parametrize("form", FORMS)
def test_faces_that_are_concave_keep_their_area(form: str) -> None:
    vertices: Element = ("vertex", [f"double {axis}" for axis in "xyz"], GRID)
    for row in (L_SHAPE, [L_SHAPE[0][2:] + L_SHAPE[0][:2]]):
        assert area(ply(form, vertices, ("face", FACE, [row]))) == 3
        assert area(ply(form, vertices, ("face", FACE, [row, [[0, 1, 5, 4]], [[4, 5, 9]]]))) == 4.5
        assert area(ply(form, vertices, ("face", FACE, [[row[0][::-1]]]))) == -3


@pytest.mark.parametrize("form", FORMS)
def test_strips_become_triangles_that_face_one_way(form: str) -> None:
    strip = [4, 0, 5, 1, 6, 2, -1, 8, 4, 9, 9, 9, 5, 5, 6, 10]
    vertices: Element = ("vertex", XYZ, GRID)
    content = ply(form, vertices, ("tristrips", ["list int int vertex_indices"], [[strip], [[2, 3, 6]]]))
    _, triangles, _ = mesh_of(content)
    # The second strip goes on at another place by four triangles without area.
    assert {frozenset(row) for row in triangles.T.tolist()} == {
        frozenset(row)
        for row in [(4, 0, 5), (0, 5, 1), (5, 1, 6), (1, 6, 2), (8, 4, 9), (5, 6, 10), (2, 3, 6)]
    }
    assert area(content) == 3.5


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("names", ["s t", "u v", "texture_u texture_v", "texture_s texture_t"])
def test_vertex_texture_coordinates_have_several_names(form: str, names: str) -> None:
    pairs = [[x / 4, y / 4] for x, y, _ in GRID]
    rows = [[*place, *pair] for place, pair in zip(GRID, pairs, strict=True)]
    vertices: Element = ("vertex", XYZ + [f"float {name}" for name in names.split()], rows)
    _, _, texture = mesh_of(ply(form, vertices, ("face", FACE, MIXED)))
    assert texture.T.tolist() == pairs


@pytest.mark.parametrize("form", FORMS)
def test_corner_texture_coordinates_are_read(form: str) -> None:
    corners = [[0.0, 0.25], [0.5, 0.25], [0.5, 0.75], [0.0, 0.75]]
    rows = [
        [[0, 1, 5, 4], [part for pair in corners for part in pair], 0],
        [[1, 2, 5], [], 1],
        [[5, 4, 0], [part for pair in (corners[2], corners[3], corners[0]) for part in pair], 0],
    ]
    faces: Element = ("face", [*FACE, "list uchar float texcoord", "int texnumber"], rows)
    vertices, triangles, texture = mesh_of(ply(form, ("vertex", XYZ, GRID), faces))
    found = [
        [(tuple(vertices[:2, i].tolist()), tuple(texture[:, i].tolist())) for i in row] for row in triangles.T
    ]
    on = {(x, y): tuple(corners[i]) for i, (x, y) in enumerate([(0, 0), (1, 0), (1, 1), (0, 1)])}
    assert all(on[place] == pair for face in (*found[:2], found[3]) for place, pair in face)
    # A face without its own has them as a triangle of a mesh without any has them.
    assert found[2] == [((1, 0), (0, 0)), ((2, 0), (1, 0)), ((1, 1), (0, 1))]
    assert area(ply(form, ("vertex", XYZ, GRID), faces)) == 2


def test_mesh_is_read_as_by_another_reader() -> None:
    solid = trimesh.creation.icosphere(subdivisions=2)
    for encoding in ("ascii", "binary"):
        content = solid.export(file_type="ply", encoding=encoding)
        vertices, triangles, _ = mesh_of(content)
        np.testing.assert_array_equal(triangles.T, solid.faces)
        np.testing.assert_allclose(vertices.T, solid.vertices, rtol=0, atol=1e-7)


def triangle(**changes: list[Any]) -> bytes:
    rows = {"vertex": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], "face": [[[0, 1, 2]]], **changes}
    return ply("ascii", ("vertex", XYZ, rows["vertex"]), ("face", FACE, rows["face"]))


BINARY = ply("binary_little_endian", ("vertex", XYZ, GRID), ("face", FACE, MIXED))
WRONG = {
    "a vertex that is no number": (
        triangle(vertex=[[0.0] * 3, [0.0, float("nan"), 1.0]]),
        "vertex 1 line 11",
    ),
    "a word": (triangle().replace(b"1.0 0.0", b"1.0 1.#QNAN", 1), "line 11 1.#qnan"),
    "a vertex beyond": (triangle(face=[[[0, 1, 2]], [[0, 1, 2, 3]]]), "face 1 line 14 vertex 3 0"),
    "a negative vertex": (triangle(face=[[[0, -1, 2]]]), "face 0 line 13 vertex -1"),
    "half a vertex": (triangle(face=[[[0, 1, 1.5]]]), "face 0 vertex 1.5"),
    "a list of half a number": (triangle().replace(b"3 0 1 2", b"2.5 0 1 2"), "face 0 line 13 2.5"),
    "a list of -3": (triangle().replace(b"3 0 1 2", b"-3 0 1 2"), "face 0 line 13 -3"),
    "a text that ends": (triangle()[:-4], "row 1 'face' cut short"),
    "a list that ends": (BINARY[:-3], "row 4 'face' cut short"),
    "vertices that end": (BINARY[:250], "'vertex' cut short"),
    "no property x": (BINARY.replace(b"float x", b"float w"), "'x'"),
    "no list of vertices": (BINARY.replace(b"vertex_indices", b"vertex_numbers"), "'vertex_indices'"),
    "an unknown type": (BINARY.replace(b"float y", b"real y"), "line 5 property real y"),
    "an unknown format": (BINARY.replace(b"binary_little", b"binary_middle"), "line 2 binary_middle_endian"),
    "no format": (triangle().replace(b"format ascii 1.0", b"comment"), "'format' ascii"),
    "no end": (triangle().replace(b"end_header", b"end_head"), "'end_header'"),
    "corners without coordinates": (
        ply(
            "ascii",
            ("vertex", XYZ, GRID),
            ("face", [*FACE, "list uchar float texcoord"], [[[0, 1, 5], [0.5]]]),
        ),
        "face 0 line 23 3 corners 'texcoord'",
    ),
}


@pytest.mark.parametrize(("content", "named"), WRONG.values(), ids=WRONG)
def test_error_names_its_place(content: bytes, named: str) -> None:
    with pytest.raises(AssetError) as caught:
        mesh_of(content)
    said = str(caught.value)
    assert all(word in said.lower() for word in named.split()), said
    assert said.endswith(".")


def test_file_that_is_damaged_raises_an_asset_error() -> None:
    random = np.random.default_rng(5)
    texts = ply("ascii", ("vertex", XYZ, GRID), ("face", FACE, MIXED))
    for content in (BINARY, texts):
        for end in range(4, len(content) - 1, 3):
            with pytest.raises(AssetError):
                mesh_of(content[:end])
        for _ in range(300):
            damaged = bytearray(content)
            damaged[random.integers(4, len(content))] = random.integers(256)
            try:
                vertices, triangles, _ = mesh_of(bytes(damaged))
            except AssetError:
                continue
            assert np.isfinite(vertices).all()
            assert 0 <= triangles.min() <= triangles.max() < vertices.shape[1]
