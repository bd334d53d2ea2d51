import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from renderer.cameras import build_pinhole
from renderer.meshes.files import read_mesh
from schemas.reading import read_scene
from service.converting.errors import ConversionError
from service.converting.formats import convert
from service.converting.obj import write_obj
from tests.service.converting.conftest import TRIANGLE, Convert, noted

EPS = float(np.finfo(float).eps)
SQUARE = b"v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


def picture() -> bytes:
    buffer = io.BytesIO()
    Image.new("RGB", (2, 2), (255, 0, 0)).save(buffer, "PNG")
    return buffer.getvalue()


def material_of(converted: Convert, lines: str, **files: bytes) -> tuple[dict[str, Any], dict[str, str]]:
    """The scene's material out of MTL lines, with all that was noted."""
    mesh = b"mtllib m.mtl\n" + SQUARE + b"usemtl paint\nf 1/1 2/2 3/3 4/4\n"
    mtl = f"newmtl paint\n{lines}\n".encode()
    conversion = converted("a.obj", mesh, **{"m.mtl": mtl, **files})
    (material,) = conversion.document["materials"].values()
    return material, noted(conversion, "assumed") | noted(conversion, "left_out")


@settings(max_examples=60, deadline=None)
@given(
    vertices=st.lists(st.tuples(*[st.floats(-1e6, 1e6, width=32)] * 3), min_size=3, max_size=8),
    scale=st.floats(1e-3, 1e3),
)
def test_default_camera_sees_every_vertex(
    tmp_path_factory: pytest.TempPathFactory, vertices: list[tuple[float, ...]], scale: float
) -> None:
    folder: Path = tmp_path_factory.mktemp("seen")
    points = np.array(vertices) * scale
    if (points == points[0]).all():
        points[1] += 1
    lines = ["v " + " ".join(map(repr, point)) for point in points.tolist()]
    lines += [f"f {' '.join(str(number + 1) for number in range(len(points)))}"]
    (folder / "cloud.obj").write_text("\n".join(lines) + "\n")
    scene = convert(folder / "cloud.obj", root=folder, folder=folder).document
    camera = build_pinhole(read_scene(scene)[0].camera)
    offsets = points.T - camera.position
    depth = (camera.forward * offsets).sum(axis=0)
    assert (depth > 0).all()
    assert (np.abs((camera.right * offsets).sum(axis=0)) <= depth * camera.half_width).all()
    assert (np.abs((camera.up * offsets).sum(axis=0)) <= depth * camera.half_height).all()


def test_mesh_of_one_material(converted: Convert) -> None:
    conversion = converted("a.obj", TRIANGLE)
    assert [shape["asset"] for shape in conversion.document["shapes"]] == ["input/a.obj"]
    assert conversion.files == {}
    assert conversion.document["materials"] == {"default": {"type": "phong", "color": [0.75] * 3}}


def test_mesh_of_two_materials(converted: Convert) -> None:
    mesh = (
        b"v 0.1 0 0\nv 1 0 0\nv 0 1e-17 0\nv 3 3 3\nusemtl a\nf 1 2 3\nusemtl b\nf 4 3 2\nusemtl a\nf 1 2 4\n"
    )
    conversion = converted("m.obj", mesh)
    names = [shape["asset"] for shape in conversion.document["shapes"]]
    assert names == ["m-a.obj", "m-b.obj"] == list(conversion.files)
    assert conversion.files["m-a.obj"].decode().splitlines() == [
        "v 0.1 0.0 0.0",
        "v 1.0 0.0 0.0",
        "v 0.0 1e-17 0.0",
        "v 3.0 3.0 3.0",
        "f 1 2 3",
        "f 1 2 4",
    ]
    assert noted(conversion, "assumed")["usemtl"].startswith("The mesh is split into 2 files")


class One:
    def __init__(self, content: bytes) -> None:
        self.content = content

    def read(self, _name: str) -> bytes:
        return self.content


@settings(max_examples=60, deadline=None)
@given(
    faces=st.lists(
        st.lists(st.tuples(st.integers(0, 5), st.integers(-1, 3)), min_size=3, max_size=3), min_size=1
    )
)
def test_part_is_read_by_the_renderer(faces: list[list[tuple[int, int]]]) -> None:
    places = np.array([(0.1, 0, 0), (1, 0, 0), (0, 1e-17, 0), (0, 0, 1), (2, 3, 5), (7, 1, 4)])
    pairs = np.array([(0, 0), (1, 0), (0.25, 0.5), (0.125, 1 / 3)])
    corners = np.array([corner for face in faces for corner in face])
    content = write_obj(places, pairs, corners, np.full(len(faces), 3))
    vertices, triangles, texture = read_mesh("", One(content))
    np.testing.assert_array_equal(vertices[:, triangles].T, places[corners[:, 0]].reshape(-1, 3, 3))
    textured = [all(number >= 0 for _, number in face) for face in faces]
    assert (texture is not None) == any(textured)
    for face, triangle in zip(faces, triangles.T, strict=True):
        if texture is not None and all(number >= 0 for _, number in face):
            np.testing.assert_array_equal(texture[:, triangle].T, pairs[[number for _, number in face]])


@pytest.mark.parametrize(("degrees", "smooth"), [(0.5, False), (2, True)])
def test_bent_normals_are_smooth(converted: Convert, degrees: float, smooth: bool) -> None:
    angle = np.radians(degrees)
    mesh = f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn {np.sin(angle)} 0 {np.cos(angle)}\nf 1//1 2//1 3//1\n"
    (shape,) = converted("n.obj", mesh.encode()).document["shapes"]
    assert shape.get("smooth", False) is smooth


def test_phong_parameters(converted: Convert) -> None:
    material, notes = material_of(converted, "Kd 0.8 0.3 0.2\nKs 0.25 0.25 0.25\nNs 96\nillum 2")
    assert material == {"type": "phong", "color": [0.8, 0.3, 0.2], "specular": 0.25, "shininess": 96}
    assert [place for place in notes if place.startswith("paint")] == []


def test_texture_replaces_the_colour(converted: Convert) -> None:
    conversion = converted(
        "a.obj",
        b"mtllib m.mtl\n" + SQUARE + b"usemtl paint\nf 1/1 2/2 3/3 4/4\n",
        **{
            "m.mtl": b"newmtl paint\nKd 0.5 0.5 0.5\nmap_Kd red.png\nbump -bm 2 -clamp on red.png\n",
            "red.png": picture(),
        },
    )
    textures, (material,) = conversion.document["textures"], conversion.document["materials"].values()
    color = textures[material["color_texture"]]
    assert color == {"type": "image", "asset": "input/red.png", "encoding": "srgb", "wrap": "repeat"}
    assert material["diffuse"] == 0.5
    bump = textures[material["bump_map"]]
    assert (bump["encoding"], bump["wrap"]) == ("linear", "clamp")
    # -bm 2, a hundredth of the diagonal of a square with sides of 2.
    assert material["bump_height"] == pytest.approx(2 * 0.01 * np.hypot(2, 2), rel=4 * EPS)
    read_scene(conversion.document)


def test_normal_map_before_bump_map(converted: Convert) -> None:
    material, notes = material_of(converted, "norm n.png\nmap_Bump n.png", **{"n.png": picture()})
    assert "normal_map" in material
    assert "bump_map" not in material
    assert "paint: map_bump" in notes


@pytest.mark.parametrize(
    ("lines", "fields"),
    [
        ("Kr 0.5 0.5 0.5", {"mirror": 0.5}),
        ("Ks 0.5 0.5 0.5\nillum 3", {"mirror": 0.5}),
        ("Ks 0.5 0.5 0.5\nillum 1", {}),
        ("d 0.25\nNi 1.33\nillum 4", {"transmission": 0.75, "ior": 1.33}),
        ("Tr 0.75\nillum 7", {"transmission": 0.75, "ior": 1.5}),
        ("d 0.25\nillum 2", {}),
    ],
)
def test_mirrors_and_glass(converted: Convert, lines: str, fields: dict[str, float]) -> None:
    material, _ = material_of(converted, lines)
    found = {name: value for name, value in material.items() if name in {"mirror", "transmission", "ior"}}
    assert found == fields


@pytest.mark.parametrize("keyword", ["Ka", "Ke", "Pr", "map_Ks", "disp", "Tf"])
def test_missing_counterparts_have_their_lines(converted: Convert, keyword: str) -> None:
    mesh = b"mtllib m.mtl\nusemtl paint\n" + TRIANGLE
    conversion = converted("a.obj", mesh, **{"m.mtl": f"newmtl paint\nKd 1 1 1\n{keyword} 1\n".encode()})
    (note,) = [note for note in conversion.assumptions if note.place == f"paint: {keyword.lower()}"]
    assert (note.kind, note.file, note.line) == ("left_out", "m.mtl", 3)


def test_missing_files_are_noted(converted: Convert) -> None:
    material, notes = material_of(converted, "Kd 0.1 0.2 0.3\nmap_Kd gone.png")
    assert material == {"type": "phong", "color": [0.1, 0.2, 0.3]}
    assert "gone.png" in notes["paint: map_kd"]
    conversion = converted("b.obj", b"mtllib gone.mtl\nusemtl a\n" + TRIANGLE)
    assert "gone.mtl" in noted(conversion, "left_out")["mtllib gone.mtl"]
    assert conversion.document["materials"]["a"]["color"] == [0.75] * 3


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (b"v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n", 2),
        (b"v 0 0 0\nv 1 0 zero\nv 0 1 0\nf 1 2 3\n", 2),
        (b"v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", 2),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n\n# a face\nf 1 2\n", 6),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", 4),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", 4),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n", 4),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n", 4),
        (b"v 0 0 0\nv 1 0 0 \\\n\nv 0 1 0\nf /1 2 3\n", 5),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//2\n", 5),
        (b"v 0 0 0\n", 1),
    ],
)
def test_malformed_line_has_its_number(converted: Convert, content: bytes, line: int) -> None:
    with pytest.raises(ConversionError) as caught:
        converted("w.obj", content)
    assert [problem.line for problem in caught.value.problems] == [line]


GREY_PHONG = {"type": "phong", "color": [0.75] * 3}


@pytest.mark.parametrize(
    ("line", "made"),
    [
        ("Kd spectral file.rfl", GREY_PHONG),
        ("Kd xyz 0.2 0.3 0.4", GREY_PHONG),
        ("Kd 1 1", GREY_PHONG),
        ("Kd 1 -1 1", GREY_PHONG),
        ("Kd 1 1.#QNAN 1", GREY_PHONG),
        ("Kd", GREY_PHONG),
        ("Kd 0.1 0.2 0.3 0.4", {"type": "phong", "color": [0.1, 0.2, 0.3]}),
        ("Ks 1 1 1\nNs -5", GREY_PHONG | {"specular": 1, "shininess": 20}),
        ("Ns 10 # sharp\nKs 1 nan 1", GREY_PHONG),
        ("illum 4\nd -halo 0.5", GREY_PHONG | {"transmission": 0.5, "ior": 1.5}),
        ("illum 4\nd -halo", GREY_PHONG),
        ("illum 4\nTr 0 0 0", GREY_PHONG),
        ("illum 4\nTr 0.25 0 0", GREY_PHONG | {"transmission": 0.25, "ior": 1.5}),
        ("illum glass", GREY_PHONG),
        ("map_Kd", GREY_PHONG),
        ("map_Kd -s 1 1 1", GREY_PHONG),
        ("map_Kd -clamp", GREY_PHONG),
        ("map_Kd m.mtl", GREY_PHONG),
        ("bump -bm", GREY_PHONG),
        ("newmtl", GREY_PHONG),
        ("Kd \xff", GREY_PHONG),
    ],
)
def test_unusable_material_line_is_noted(converted: Convert, line: str, made: dict[str, Any]) -> None:
    mtl = f"newmtl paint\n{line}\n".encode("latin-1")
    conversion = converted("a.obj", b"mtllib m.mtl\nusemtl paint\n" + TRIANGLE, **{"m.mtl": mtl})
    assert conversion.document["materials"] == {"paint": made}
    last = 1 + len(line.splitlines())
    noted_lines = {(note.kind, note.file, note.line) for note in conversion.assumptions}
    assert ("left_out", "m.mtl", last) in noted_lines


@pytest.mark.parametrize(
    ("line", "name", "wrap"),
    [
        ("map_Kd -s 1 1 1 -o 0.5 -clamp on oak  wood 2.png", "oak  wood 2.png", "clamp"),
        ("map_Kd -mm 0 1 -t 0 0 0 -bm 2 oak.png", "oak.png", "repeat"),
        ("map_Kd -O 1 2 oak.png", "oak.png", "repeat"),
        ("map_Kd -blendu on -imfchan r\toak.png", "oak.png", "repeat"),
        ("map_Kd oak#2.png", "oak#2.png", "repeat"),
        ("map_Kd oak #2.png", "oak #2.png", "repeat"),
        ("map_Kd oak.png # a comment", "oak.png", "repeat"),
        ("map_Kd caf\xe9.png", "caf\xe9.png", "repeat"),
    ],
)
def test_texture_options(converted: Convert, line: str, name: str, wrap: str) -> None:
    for encoding in ("latin-1", "utf-8"):
        mtl = f"newmtl paint\n{line}\n".encode(encoding)
        mesh = b"mtllib m.mtl\nusemtl paint\n" + SQUARE + b"f 1/1 2/2 3/3\n"
        conversion = converted("a.obj", mesh, **{"m.mtl": mtl, name: picture()})
        (texture,) = conversion.document["textures"].values()
        assert (texture["asset"], texture["wrap"]) == (f"input/{name}", wrap)
