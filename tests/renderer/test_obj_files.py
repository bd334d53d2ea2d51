"""OBJ files as meshes: what each way of writing means, and which lines are refused."""

import io
import re
from typing import Any

import numpy as np
import pytest
import trimesh

from renderer.assets import AssetError
from renderer.math.arrays import Floats
from renderer.meshes.files import read_mesh
from tests.pictures.parts import Files


def read(content: bytes) -> tuple[Floats, Floats | None]:
    """Places (T, 3, 3) of the corners of all triangles, and their texture coordinates (T, 3, 2)."""
    vertices, triangles, texture = read_mesh("m.obj", Files({"m.obj": content}))
    return vertices[:, triangles].T, None if texture is None else texture[:, triangles].T


PLACES = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
TWO_FACES = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])[[[0, 1, 2], [1, 2, 3]]]


@pytest.mark.parametrize(
    "content",
    [
        PLACES + b"f 1 2 3\nf 2 3 4\n",
        PLACES + b"f 1 2 3\nf 2 3 4",
        PLACES + b"f -4 -3 -2\nf -3 -2 -1\nv 9 9 9\n",
        PLACES + b"vn 0 0 1\nf 1//-1 2//-1 3//-1\nvn 1 0 0\nf 2//1 3//1 -1//1\n",
        PLACES + b"f 1 2 3 # the first\n  f 2 3 4\n",
        PLACES.replace(b"v 1", b"v\t1") + b"\tf 1 2 3\nf\t2\t3\t4 #\n",
        PLACES + b"usemtl red #1\nf 1 \\\n 2 3\ng\nf 2 3 \\\r\n 4\r\n",
        PLACES + b"f 1 2 3\rf 2 3 4\r",
        PLACES.replace(b"\n", b"\r") + b"f 1 2 3\rf 2 3 4\r",
        PLACES.replace(b"\n", b"\r\n") + b"f 1 2 3\r\nf 2 3 4\r\n",
        b"f 1 2 3\nf 2 3 4\n" + PLACES,
        b"\xef\xbb\xbf" + PLACES + b"f 1 2 3\nf 2 3 4\n",
        b"# from C:\\models\\\n" + PLACES + b"f 1 2 3 # \\\nf 2 3 4 \\",
        b"usemtl oak # C:\\\n" + PLACES + b"g a#b\\\nf 1 2 3\nf 2 3 4\n",
        b"o caf\xe9\x85\x1c\n" + PLACES + b"f 1 2 3\nf 2 3 4\n",
        PLACES.replace(b"0\n", b"0 1.0\n") + b"f 1/ 2/ 3/\nf 2// 3// 4//\n",
        PLACES.replace(b"0\n", b"0 0.25 0.5 1e0\n") + b"f +1 2 3\nf 2 3 4\np 1\nl 1 2\n",
        PLACES + b"vt 0.5\nvt 0 0 0\n\n\nf 1 2 3\nf 2 3 4\n",
    ],
)
def test_faces_in_every_form(content: bytes) -> None:
    corners, texture = read(content)
    assert texture is None
    np.testing.assert_array_equal(corners, TWO_FACES)


def test_parts_are_one_mesh() -> None:
    faces = b"o a\nusemtl x\nf 1 2 3\no b\nusemtl y\nf 1 2 4\nusemtl x\nf 2 3 4\n"
    _, triangles, _ = read_mesh("m", Files(m=PLACES + faces))
    assert triangles.T.tolist() == [[0, 1, 2], [0, 1, 3], [1, 2, 3]]


WRONG = {
    "too few numbers": (b"v 1 0\n", "3 numbers"),
    "no numbers": (b"v\n", "3 numbers"),
    "a comment for a number": (b"v 1 # 0 0\n", "3 numbers"),
    "no texture coordinate": (b"vt\n", "2 numbers"),
    "not computed": (b"v 1 0 1.#QNAN\n", "1.#QNAN"),
    "a normal not computed": (b"vn -1.#IND 0 0\n", "-1.#IND"),
    "not a number": (b"v 1 nan 0\n", "nan"),
    "infinite": (b"vt 1 -inf\n", "-inf"),
    "too large": (b"v 1e300 0 0\n", "1e300"),
    "a decimal comma": (b"v 1,5 0,5 2,5\n", "1,5"),
    "an underscore": (b"v 1 1_0 0\n", "1_0"),
    "a colour that is none": (b"v 1 0 0 red 0 0\n", "red"),
    "a line that goes on": (b"v 1 \\\n 0 zero\n", "zero"),
    "two corners": (b"f 1 2\n", "three corners"),
    "no corner": (b"f\n", "three corners"),
    "words": (b"f one two three\n", "one"),
    "nothing": (b"f 1 2 0\n", "vertex 0"),
    "minus nothing": (b"f 1 2 -0\n", "vertex 0"),
    "too far back": (b"f -5 2 3\n", "vertex -5"),
    "too far": (b"f 1 2 5\n", "vertex 5"),
    "too long": (b"f 1 2 999999999999999999999\n", "vertex 9"),
    "too long to go back": (b"f 1 2 -999999999999999999999\n", "-9999"),
    "no texture of that number": (b"f 1/1 2/1 3/2\n", "texture coordinate 2"),
    "no normal of that number": (b"f 1//2 2//2 3//2\n", "normal 2"),
    "texture that comes later": (b"f 1/-2 2/-2 3/-2\nvt 0 0\n", "texture coordinate -2"),
    "four parts": (b"f 1/1/1/1 2 3\n", "1/1/1/1"),
    "no vertex": (b"f 1 /1 3\n", "/1"),
    "fractions": (b"f 1.5 2 3\n", "1.5"),
    "an underscored corner": (b"f 1_0 2 3\n", "1_0"),
}


@pytest.mark.parametrize("before", [0, 30_000], ids=["first", "after many"])
@pytest.mark.parametrize(("line", "named"), WRONG.values(), ids=WRONG)
def test_unusable_line(line: bytes, named: str, before: int) -> None:
    # More than are converted at once: their places are counted from the first all the same.
    right = b"f 1/1/1 2/1/1 3/1/1\n" * before if line.startswith(b"f") else b""
    content = PLACES + b"vt 0 0\nvn 0 0 1\nf 1 2 3\n" + right + line + b"f 1 2 3\n"
    number = 8 + (before if right else 0)
    with pytest.raises(AssetError, match=rf"^m\.obj:{number}: .*{re.escape(named)}.*\. "):
        read(content)


def test_wrong_vertex_among_many() -> None:
    content = b"v 1 2 3 1\n# a comment\n" * 25_000 + b"v 1 2 three\nf 1 2 3\n"
    with pytest.raises(AssetError, match=r"^m\.obj:50001: .*three"):
        read(content)


def written(rng: np.random.Generator, count: int) -> tuple[bytes, Floats, Floats]:
    """Triangles at random places in a random way of writing, and what is to be read: their corners.

    Vertices come before or after the faces that name them, numbers count from the first or the last. Some
    faces have texture coordinates for all, some or none of their corners.
    """
    places, pairs = rng.integers(-9, 9, (count, 3, 3)).astype(float), rng.integers(1, 9, (count, 3, 2)) / 8
    default = np.array([[0, 0], [1, 0], [0, 1]], dtype=float)
    lines, expected = ["vn 0 0 1"], []
    for number in range(count):
        new = [" ".join(["v", *map(repr, place)]) for place in places[number].tolist()]
        new += [" ".join(["vt", *map(repr, pair)]) for pair in pairs[number].tolist()]
        has_texture = rng.integers(2, size=3) if rng.integers(2) else np.full(3, rng.integers(2))
        is_early, is_backwards = rng.integers(2), rng.integers(2)
        words = []
        for corner in range(3):
            vertex = corner - 3 if is_early and is_backwards else 3 * number + corner + 1
            parts = [vertex, vertex if has_texture[corner] else "", rng.choice([1, -1, ""])]
            words.append("/".join(map(str, parts)).rstrip("/" if rng.integers(2) else ""))
        gaps = [str(rng.choice([" ", "  ", "\t", " \\\n "])) for _ in words]
        face = "f" + "".join(gap + word for gap, word in zip(gaps, words, strict=True))
        lines += [*new, face] if is_early else [face, *new]
        lines += [str(rng.choice(["", "# f 1 1 1 \\", "usemtl a#1", "s off"]))]
        expected.append(pairs[number] if has_texture.all() else default)
    return str(rng.choice(["\n", "\r\n", "\r"])).join(lines).encode(), places, np.array(expected)


@pytest.mark.parametrize("seed", range(12))
def test_random_file_is_read_as_written(seed: int) -> None:
    content, places, pairs = written(np.random.default_rng(seed), 20 + seed)
    corners, texture = read(content.replace(b"\\\n", b"\\\r\n") if b"\r\n" in content else content)
    np.testing.assert_array_equal(corners, places)
    assert texture is not None
    np.testing.assert_array_equal(texture, pairs)


@pytest.mark.parametrize("count", [3, 12_000], ids=["few", "many"])
@pytest.mark.parametrize("form", ["{0}", "{0}/{1}", "{0}//{2}", "{0}/{1}/{2}"])
def test_file_equals_another_reader(form: str, count: int) -> None:
    rng = np.random.default_rng(count)
    lines = [" ".join(["v", *map(repr, place)]) for place in rng.normal(size=(count, 3)).tolist()]
    lines += [" ".join(["vt", *map(repr, pair)]) for pair in rng.uniform(size=(99, 2)).tolist()]
    lines += [" ".join(["vn", *map(repr, normal)]) for normal in rng.normal(size=(99, 3)).tolist()]
    for face in rng.integers(1, count + 1, (2 * count, 3)).tolist():
        lines.append("f " + " ".join(form.format(v, 1 + v % 99, 1 + v % 97) for v in face))
    content = "\n".join(lines).encode() + b"\n"
    corners, texture = read(content)
    other: Any = trimesh.load(io.BytesIO(content), file_type="obj", process=False)
    np.testing.assert_array_equal(corners, other.vertices[other.faces])
    if "{1}" in form:
        np.testing.assert_array_equal(texture, other.visual.uv[other.faces])
    else:
        assert texture is None


def polygon(points: list[tuple[int, int]]) -> bytes:
    # Tilted, so that no coordinate is the same for all corners.
    lines = [f"v {x} {y} {2 * x - y}" for x, y in points]
    return "\n".join([*lines, "f " + " ".join(str(i + 1) for i in range(len(points)))]).encode() + b"\n"


CONCAVE = {
    "L": [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)],
    "U": [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)],
    "star": [(4, 0), (1, 1), (0, 4), (-1, 1), (-4, 0), (-1, -1), (0, -4), (1, -1)],
    "dart": [(1, 1), (0, 3), (-3, -3), (3, 0)],
}


@pytest.mark.parametrize("points", CONCAVE.values(), ids=CONCAVE)
@pytest.mark.parametrize("turn", range(4))
def test_concave_face_is_covered_once(points: list[tuple[int, int]], turn: int) -> None:
    corners, _ = read(polygon(points[turn:] + points[:turn]))
    x, y, _ = corners.T
    areas = ((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])) / 2
    shoelace = (
        sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(points, points[1:] + points[:1], strict=True)) / 2
    )
    assert (areas * np.sign(shoelace) >= 0).all()
    assert areas.sum() == shoelace


SQUARE = [(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)]
CORNERS_OF_PICTURE = [(0, 0), (1, 0), (1, 1), (0, 1)]


def corners_of(*faces: str) -> list[list[tuple[Any, Any]]]:
    """Place and texture coordinates of every corner of the triangles that an OBJ file has."""
    lines = [f"v {x} {y} {z}" for x, y, z in SQUARE] + [f"vt {u} {v}" for u, v in CORNERS_OF_PICTURE]
    corners, texture = read("\n".join([*lines, *(f"f {face}" for face in faces)]).encode() + b"\n")
    assert texture is not None
    return [
        [(tuple(place), tuple(uv)) for place, uv in zip(*triangle, strict=True)]
        for triangle in zip(corners.tolist(), texture.tolist(), strict=True)
    ]


def test_vertex_on_a_seam() -> None:
    first, second = corners_of("1/1 2/2 3/3", "1/4 3/2 4/1")
    assert first == [(SQUARE[0], (0, 0)), (SQUARE[1], (1, 0)), (SQUARE[2], (1, 1))]
    assert second == [(SQUARE[0], (0, 1)), (SQUARE[2], (1, 0)), (SQUARE[3], (0, 0))]
