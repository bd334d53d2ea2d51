from __future__ import annotations

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
from service.converting.obj import by_material, write_part
from service.converting.wavefront import Face, ObjText
from tests.unit.converting.conftest import TRIANGLE, Convert, noted

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
def test_the_default_camera_sees_every_vertex(
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


def test_a_mesh_of_one_material_is_named_where_it_lies(converted: Convert) -> None:
    conversion = converted("a.obj", TRIANGLE)
    assert [shape["asset"] for shape in conversion.document["shapes"]] == ["input/a.obj"]
    assert conversion.files == {}
    assert conversion.document["materials"] == {"default": {"type": "phong", "color": [0.75] * 3}}


def test_a_mesh_of_two_materials_is_cut_without_losing_a_digit(converted: Convert) -> None:
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


@settings(max_examples=60, deadline=None)
@given(
    corners=st.lists(
        st.tuples(st.integers(0, 5), st.one_of(st.none(), st.integers(0, 3))), min_size=3, max_size=12
    )
)
def test_a_written_part_is_read_by_the_renderer_with_the_same_corners(
    corners: list[tuple[int, int | None]],
) -> None:
    # The six places are in general position, so that no triangle is without area.
    obj = ObjText(
        vertices=[(0.0, 0, 0), (1.0, 0, 0), (0.0, 1, 0), (0.0, 0, 1), (2.0, 3, 5), (7.0, 1, 4)],
        texture=[(0.0, 0.0), (1.0, 0.0), (0.25, 0.5), (0.125, 1.0)],
    )
    triples = [tuple((v, t, None) for v, t in corners[i : i + 3]) for i in range(0, len(corners) - 2, 3)]
    faces = [Face(triple, None, 1) for triple in triples if len({v for v, _, _ in triple}) == 3]
    if not faces:
        return
    vertices, triangles, texture = read_mesh("", One(write_part(obj, faces)))
    for face, triangle in zip(faces, triangles.T, strict=True):
        for (place, uv, _), corner in zip(face.corners, triangle, strict=True):
            assert tuple(vertices[:, corner]) == obj.vertices[place]
            if texture is not None:
                assert tuple(texture[:, corner]) == (obj.texture[uv] if uv is not None else (0, 0))
    assert (texture is None) == all(uv is None for face in faces for _, uv, _ in face.corners)


class One:
    def __init__(self, content: bytes) -> None:
        self.content = content

    def read(self, _name: str) -> bytes:
        return self.content


def test_faces_keep_their_order_within_a_material() -> None:
    faces = [Face(((0, None, None),) * 3, name, line) for line, name in enumerate("abab")]
    parts = by_material(ObjText(faces=faces))
    assert {name: [face.line for face in some] for name, some in parts.items()} == {"a": [0, 2], "b": [1, 3]}


@pytest.mark.parametrize(("degrees", "smooth"), [(0.5, False), (2, True)])
def test_normals_that_are_not_those_of_the_faces_ask_for_smoothness(
    converted: Convert, degrees: float, smooth: bool
) -> None:
    angle = np.radians(degrees)
    mesh = f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn {np.sin(angle)} 0 {np.cos(angle)}\nf 1//1 2//1 3//1\n"
    (shape,) = converted("n.obj", mesh.encode()).document["shapes"]
    assert shape.get("smooth", False) is smooth


def test_diffuse_specular_and_sharpness_are_taken_over(converted: Convert) -> None:
    material, notes = material_of(converted, "Kd 0.8 0.3 0.2\nKs 0.25 0.25 0.25\nNs 96\nillum 2")
    assert material == {"type": "phong", "color": [0.8, 0.3, 0.2], "specular": 0.25, "shininess": 96}
    assert [place for place in notes if place.startswith("paint")] == []


def test_a_picture_takes_the_place_of_the_colour_and_kd_scales_it(converted: Convert) -> None:
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


def test_a_normal_map_is_taken_before_a_bump_map(converted: Convert) -> None:
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
def test_mirrors_and_glass_follow_the_illumination_model(
    converted: Convert, lines: str, fields: dict[str, float]
) -> None:
    material, _ = material_of(converted, lines)
    found = {name: value for name, value in material.items() if name in {"mirror", "transmission", "ior"}}
    assert found == fields


@pytest.mark.parametrize("keyword", ["Ka", "Ke", "Pr", "map_Ks", "disp", "Tf"])
def test_what_has_no_counterpart_is_noted_with_its_line(converted: Convert, keyword: str) -> None:
    mesh = b"mtllib m.mtl\nusemtl paint\n" + TRIANGLE
    conversion = converted("a.obj", mesh, **{"m.mtl": f"newmtl paint\nKd 1 1 1\n{keyword} 1\n".encode()})
    (note,) = [note for note in conversion.assumptions if note.place == f"paint: {keyword.lower()}"]
    assert (note.kind, note.file, note.line) == ("left_out", "m.mtl", 3)


def test_zeros_without_counterpart_are_not_noted(converted: Convert) -> None:
    _, notes = material_of(converted, "Kd 1 1 1\nKe 0.0 0.0 0.0")
    assert not [place for place in notes if place.startswith("paint")]


def test_missing_pictures_and_libraries_leave_colours_and_are_noted(converted: Convert) -> None:
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
        (b"v 0 0 0\n", 1),
    ],
)
def test_a_malformed_line_is_reported_by_its_number(converted: Convert, content: bytes, line: int) -> None:
    with pytest.raises(ConversionError) as caught:
        converted("w.obj", content)
    assert [problem.line for problem in caught.value.problems] == [line]


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (b"Kd 1 1 1\nnewmtl a\n", 1),
        (b"newmtl a\nKd 1 1\n", 2),
        (b"newmtl a\n\nKd 1 -1 1\n", 3),
        (b"newmtl a\nmap_Kd -s 1 1 1\n", 2),
        (b"newmtl\n", 1),
    ],
)
def test_a_wrong_line_of_an_mtl_file_is_reported_by_file_and_number(
    converted: Convert, content: bytes, line: int
) -> None:
    with pytest.raises(ConversionError) as caught:
        converted("w.obj", b"mtllib m.mtl\nusemtl a\n" + TRIANGLE, **{"m.mtl": content})
    assert (caught.value.name, caught.value.problems[0].line) == ("m.mtl", line)


def test_backward_numbers_and_long_lines_mean_the_same(converted: Convert) -> None:
    usual = converted("u.obj", b"usemtl a\n" + TRIANGLE + b"usemtl b\n" + b"f 1 3 2\n").files
    other = b"usemtl a\nv 0 0 0\nv 1 \\\n 0 0\nv 0 1 0\nf -3 -2 -1\nusemtl b\nf -3 -1 -2\n"
    assert list(converted("o.obj", other).files.values()) == list(usual.values())
