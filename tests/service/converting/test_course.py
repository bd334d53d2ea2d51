import json
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import renderer
from renderer.assets import FolderAssets
from renderer.cameras import build_pinhole
from schemas.quality import FixedQuality
from schemas.quantities import difference, sine_between
from schemas.reading import read_scene
from service.converting.errors import ConversionError
from service.converting.formats import convert
from tests.service.converting.conftest import TRIANGLE, Convert, course, noted

EPS = float(np.finfo(float).eps)
LEAST_SINE = 0.1

places = st.tuples(*[st.floats(-100, 100)] * 3)
colors = st.lists(st.floats(0, 20), min_size=3, max_size=3)
names = st.text(st.characters(codec="utf-8", exclude_categories=["Cs", "Cc"]), min_size=1, max_size=20)


@st.composite
def cameras(draw: st.DrawFn) -> dict[str, Any]:
    """Cameras that look somewhere, with an upward direction that is not nearly their view."""
    position, look_at, up = draw(places), draw(places), draw(places)
    view = difference(look_at, position)
    if sine_between(view, up) < LEAST_SINE:
        # Turned by a right angle about some axis, one of the three is far from the view.
        up = max(((1, 0, 0), (0, 1, 0), (0, 0, 1)), key=lambda axis: sine_between(view, axis))
    if position == look_at:
        look_at, up = (position[0] + 1, *position[1:]), (0, 1, 0)
    return {
        "position": position,
        "look_at": look_at,
        "ref_up": up,
        "vertical_fov": draw(st.floats(1, 120)),
        "focal_length": draw(st.floats(0.01, 100)),
    }


@st.composite
def documents(draw: st.DrawFn) -> dict[str, Any]:
    """Course scenes of any materials and objects, some with fields of a student's own."""
    kinds = st.sampled_from(["diffuse", "specular", "translucent", "transmission", "glossy"])
    used = draw(st.lists(names, min_size=1, max_size=3, unique=True))
    document = {
        "spp": draw(st.integers(1, 65536)),
        "max_depth": draw(st.integers(0, 100)),
        "image_resolution": [draw(st.integers(1, 300)), draw(st.integers(1, 300))],
        "cam_config": draw(cameras()),
        "light_config": {
            "position": draw(places),
            "size": [draw(st.floats(1e-3, 10)), draw(st.floats(1e-3, 10))],
            "radiance": draw(colors),
        },
        "materials": [{"name": name, "type": draw(kinds), "color": draw(colors)} for name in used],
        "objects": [
            {
                "obj_file_path": "mesh.obj",
                "material_name": draw(st.sampled_from(used)),
                "translate": draw(places),
                "scale": draw(st.floats(1e-3, 100)),
                "has_bvh": draw(st.booleans()),
            }
            for _ in range(draw(st.integers(0, 3)))
        ],
    }
    own = {name: 1 for name in draw(st.sets(names, max_size=2)) if name not in document}
    return document | own


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made: Path = tmp_path_factory.mktemp("course")
    (made / "mesh.obj").write_bytes(TRIANGLE)
    return made


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(document=documents())
def test_any_scene_is_converted_and_renders(folder: Path, document: dict[str, Any]) -> None:
    (folder / "scene.json").write_text(json.dumps(document))
    conversion = convert(folder / "scene.json", root=folder, folder=folder)
    scene, _ = read_scene(json.dumps(conversion.document).encode())
    plan = renderer.compile_scene(renderer.load_scene(scene, assets=FolderAssets(folder)))
    assert (plan.width, plan.height) == tuple(document["image_resolution"])
    assert len(scene.shapes) == len(document["objects"])
    unknown = document.keys() - course().keys()
    assert {"/" + name.replace("~", "~0").replace("/", "~1") for name in unknown} <= noted(
        conversion, "left_out"
    ).keys()


def course_direction(camera: dict[str, Any], width: int, height: int, x: float, y: float) -> list[Any]:
    """The unit direction of the course's camera, in 50 digits.

    (x, y) counts pixels from the corner at the lower left. With forward, right = forward x ref_up and
    up = right x forward, all unit, and the screen focal_length away: forward focal_length + right
    (2 x / width - 1) half aspect + up (2 y / height - 1) half, half = tan(vertical_fov / 2) focal_length.
    """
    with mpmath.workdps(50):
        position, look_at, ref_up = (
            mpmath.matrix([mpmath.mpf(number) for number in camera[name]])
            for name in ("position", "look_at", "ref_up")
        )
        forward = unit(look_at - position)
        right = unit(cross(forward, ref_up))
        up = cross(right, forward)
        focal = mpmath.mpf(camera["focal_length"])
        half = mpmath.tan(mpmath.radians(mpmath.mpf(camera["vertical_fov"])) / 2) * focal
        aspect = mpmath.mpf(width) / height
        across = (2 * mpmath.mpf(x) / width - 1) * half * aspect
        along = (2 * mpmath.mpf(y) / height - 1) * half
        return list(unit(forward * focal + right * across + up * along))


def unit(vector: Any) -> Any:
    return vector / mpmath.norm(vector)


def cross(a: Any, b: Any) -> Any:
    return mpmath.matrix([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@settings(max_examples=60, deadline=None)
@given(
    camera=cameras(),
    size=st.tuples(st.integers(1, 200), st.integers(1, 200)),
    place=st.tuples(st.integers(0, 64), st.integers(0, 64)),
)
def test_camera_rays(
    folder: Path, camera: dict[str, Any], size: tuple[int, int], place: tuple[int, int]
) -> None:
    (folder / "camera.json").write_text(
        json.dumps(course(cam_config=camera, image_resolution=size, objects=[]))
    )
    conversion = convert(folder / "camera.json", root=folder, folder=folder)
    view = build_pinhole(read_scene(json.dumps(conversion.document).encode())[0].camera)
    (width, height), (x, y) = size, (place[0] / 64 * size[0], place[1] / 64 * size[1])
    found = view.directions(np.array([x]), np.array([height - y]))[:, 0]
    true = course_direction(camera, width, height, x, y)
    sine = sine_between(difference(camera["look_at"], camera["position"]), camera["ref_up"])
    # The basis is off by 5 eps over the sine, tangent and products by a few eps more.
    allowed = 32 * EPS / sine
    assert view.position[:, 0].tolist() == list(camera["position"])
    assert [float(a) for a in found / np.linalg.norm(found)] == pytest.approx(
        [float(b) for b in true], rel=0, abs=allowed
    )


def test_published_fields(converted: Convert) -> None:
    scene = converted("box.json", course(), **{"left.obj": TRIANGLE}).document
    assert scene["camera"] == {
        "position": (0, 1, 6.8),
        "look_at": (0, 1, 0),
        "up": (0, 1, 0),
        "vertical_fov": 19.5,
        "focal_length": 1,
        "width": 48,
        "height": 32,
    }
    assert scene["materials"] == {"red": {"type": "phong", "color": (0.63, 0.065, 0.05)}}
    (shape,) = scene["shapes"]
    assert (shape["asset"], shape["material"]) == ("input/left.obj", "red")
    assert (shape["scale"], shape["translate"]) == ((2, 2, 2), (0.5, 0, -1))
    assert scene["sampling"]["antialiasing"] == {"pattern": "random", "samples": 16}


def test_light_of_a_path_tracer(converted: Convert) -> None:
    floor = b"v -9 0 -9\nv -9 0 9\nv 9 0 9\nv 9 0 -9\nf 1 2 3\nf 1 3 4\n"
    height, width, depth = 2.0, 0.5, 0.3
    document = course(
        image_resolution=[1, 1],
        cam_config={"position": [0, 1, 3], "look_at": [0, 0, 0], "vertical_fov": 1e-3},
        light_config={"position": [0, height, 0], "size": [width, depth], "radiance": [17, 12, 5]},
        objects=[{"obj_file_path": "floor.obj", "material_name": "red"}],
    )
    conversion = converted("floor.json", document, **{"floor.obj": floor})
    scene = conversion.document | {
        "sampling": {"antialiasing": {"pattern": "center"}, "light": {"pattern": "uniform", "samples": 4096}}
    }
    assets = {"input/floor.obj": floor}
    result = renderer.render(
        renderer.compile_scene(renderer.load_scene(json.dumps(scene).encode(), assets=Files(assets))),
        quality=FixedQuality(mode="fixed", precision="double"),
    )
    # Form factor of a rectangle from a point under its corner, parallel to it; the light has four such parts.
    a, b = width / 2 / height, depth / 2 / height
    part = (
        a / np.hypot(1, a) * np.arctan(b / np.hypot(1, a))
        + b / np.hypot(1, b) * np.arctan(a / np.hypot(1, b))
    ) / (2 * np.pi)
    true = 4 * part * np.array([17, 12, 5]) * np.array([0.63, 0.065, 0.05])
    # 64 x 64 cell centres: the midpoint rule is off by the square of a cell in heights, (0.25 / 64)^2.
    np.testing.assert_allclose(result.image[0, 0], true, rtol=(width / height / 64) ** 2)


class Files(dict[str, bytes]):
    def read(self, name: str) -> bytes:
        return self[name]


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        ("specular", {"mirror": 0.5, "diffuse": 0, "max_depth": 12}),
        ("translucent", {"transmission": 0.5, "ior": 1.5, "diffuse": 0, "max_depth": 12}),
        ("diffuse", {}),
        ("velvet", {}),
    ],
)
def test_materials(converted: Convert, kind: str, fields: dict[str, Any]) -> None:
    material = {"name": "red", "type": kind, "color": [0.5, 0.5, 0.5]}
    made = converted("m.json", course(materials=[material], objects=[])).document["materials"]["red"]
    assert {name: made[name] for name in fields} == fields
    assert ("mirror" in made, "transmission" in made) == ("mirror" in fields, "transmission" in fields)


def test_left_out_fields_have_their_lines(converted: Convert) -> None:
    text = json.dumps(course(objects=[], nurbs=1), indent=1).encode()
    notes = converted("n.json", text).assumptions
    (note,) = [note for note in notes if note.place == "/nurbs"]
    assert note.kind == "left_out"
    assert note.line is not None
    assert text.splitlines()[note.line - 1].strip() == b'"nurbs": 1'
    assert "/max_depth" in {note.place for note in notes}


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"cam_config": course()["cam_config"] | {"vertical_fov": 180}}, "/cam_config/vertical_fov"),
        ({"cam_config": course()["cam_config"] | {"ref_up": [0, 0, 0]}}, "/cam_config/ref_up"),
        ({"image_resolution": [48]}, "/image_resolution"),
        (
            {"light_config": {"position": [0, 0, 0], "size": [0, 1], "radiance": [1, 1, 1]}},
            "/light_config/size/0",
        ),
        ({"materials": [{"name": "red", "color": [1, -1, 1]}]}, "/materials/0/color/1"),
        ({"objects": [{"obj_file_path": "left.obj", "material_name": "rde"}]}, "/objects/0/material_name"),
        ({"objects": [{"obj_file_path": "gone.obj", "material_name": "red"}]}, "/objects/0/obj_file_path"),
        ({"objects": [{"obj_file_path": "odd.obj", "material_name": "red"}]}, "/objects/0/obj_file_path"),
        ({"objects": [{"material_name": "red"}]}, "/objects/0"),
        ({"objects": 3}, "/objects"),
    ],
)
def test_problems_are_located(converted: Convert, changes: dict[str, Any], pointer: str) -> None:
    text = json.dumps(course(**changes), indent=1).encode()
    with pytest.raises(ConversionError) as caught:
        converted("w.json", text, **{"left.obj": TRIANGLE, "odd.obj": b"v 0 0 0\nv 1 0 0\nf 1 2 9\n"})
    assert [problem.pointer for problem in caught.value.problems] == [pointer]
    assert caught.value.problems[0].line is not None
