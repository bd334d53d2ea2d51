"""Which numbers make a scene, and which do not: every one that is hard, with its place and the cure."""

import math
import warnings
from typing import Any

import numpy as np
import pytest

import renderer
from accuracy.hard_cases.documents import (
    Json,
    bulb,
    camera,
    ellipsoid,
    lamp,
    phong,
    rectangle,
    sampled,
    scene,
    sphere,
    sun,
    triangle,
)
from schemas.errors import SceneError
from schemas.reading import read_scene

FLOOR = rectangle([-4, 0, -4], [0, 0, 9], [8, 0, 0])
NAN = math.nan


def shown(*shapes: Json, **changes: Any) -> Json:
    """Shapes on a floor under a lamp; without shapes the floor alone."""
    return scene(*shapes, FLOOR, **{"lights": [lamp([0, 5, 0], [1, 0, 0], [0, 0, 1])], **changes})


def seen(**changes: Any) -> Json:
    return shown(camera=camera(**changes))


def card(**changes: Any) -> Json:
    return {
        "type": "rectangle",
        "center": [0, 1, 0],
        "normal": [0, 0, 1],
        "tangent": [1, 0, 0],
        "size": [2, 1],
        "material": "plain",
        **changes,
    }


def painted(**changes: Any) -> Json:
    return shown(materials={"plain": phong(**changes)})


def counted(part: str, samples: object) -> Json:
    document = shown()
    document["sampling"][part] = {"pattern": "random", "samples": samples}
    return document


def mesh(**changes: Any) -> Json:
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    return {"type": "mesh", "vertices": corners, "triangles": [[0, 1, 2]], "material": "plain", **changes}


CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
FINITE = "must be a finite number"

REFUSED: list[tuple[str, Json, str, str]] = [
    (
        "camera in its own target",
        seen(position=[1, 2, 3], look_at=[1, 2, 3]),
        "/camera/look_at",
        "Move one of",
    ),
    ("view of 0 degrees", seen(vertical_fov=0), "/camera/vertical_fov", "more than 0"),
    ("view of -10 degrees", seen(vertical_fov=-10), "/camera/vertical_fov", "more than 0"),
    ("view of 180 degrees", seen(vertical_fov=180), "/camera/vertical_fov", "less than 180"),
    ("view of 200 degrees", seen(vertical_fov=200), "/camera/vertical_fov", "less than 180"),
    ("view of NaN", seen(vertical_fov=NAN), "/camera/vertical_fov", FINITE),
    ("focal length 0", seen(focal_length=0), "/camera/focal_length", "1e-100 or more"),
    ("focal length -1", seen(focal_length=-1), "/camera/focal_length", "1e-100 or more"),
    ("up of no length", seen(up=[0, 0, 0]), "/camera/up", "other than 0"),
    ("width 0", seen(width=0), "/camera/width", "at least 1"),
    ("width -1", seen(width=-1), "/camera/width", "at least 1"),
    ("width 1.5", seen(width=1.5), "/camera/width", "whole number"),
    ("width true", seen(width=True), "/camera/width", "whole number"),
    ("height of a billion", seen(height=10**9), "/camera/height", "at most 65536"),
    ("samples 0", counted("antialiasing", 0), "/sampling/antialiasing/samples", "at least 1"),
    ("light points 0", counted("light", 0), "/sampling/light/samples", "at least 1"),
    (
        "edge of no length",
        shown(rectangle([0, 0, 0], [0, 0, 0], [1, 0, 0])),
        "/shapes/0/edges/0",
        "Make it longer",
    ),
    (
        "parallel edges",
        shown(rectangle([0, 0, 0], [1, 2, 3], [2, 4, 6])),
        "/shapes/0/edges",
        "Turn one of them",
    ),
    ("tangent along the normal", shown(card(tangent=[0, 0, -2])), "/shapes/0/tangent", "Turn it"),
    ("normal of no length", shown(card(normal=[0, 0, 0])), "/shapes/0/normal", "other than 0"),
    ("rectangle of no width", shown(card(size=[0, 1])), "/shapes/0/size/0", "1e-100 or more"),
    ("radius 0", shown(sphere([0, 1, 0], 0)), "/shapes/0/radius", "1e-100 or more"),
    ("radius -1", shown(sphere([0, 1, 0], -1)), "/shapes/0/radius", "1e-100 or more"),
    ("radius NaN", shown(sphere([0, 1, 0], NAN)), "/shapes/0/radius", FINITE),
    ("radius 1e-320", shown(sphere([0, 1, 0], 1e-320)), "/shapes/0/radius", "1e-100 or more"),
    ("radius 1e-200", shown(sphere([0, 1, 0], 1e-200)), "/shapes/0/radius", "1e-100 or more"),
    (
        "semi-axis 0",
        shown(ellipsoid([0, 1, 0], [1, 0, 0], [0, 0, 0], [0, 0, 1])),
        "/shapes/0/axes/1",
        "Make it longer",
    ),
    (
        "semi-axis 1e-320",
        shown(ellipsoid([0, 1, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1e-320])),
        "/shapes/0/axes/2",
        "Make it longer",
    ),
    (
        "semi-axis NaN",
        shown(ellipsoid([0, 1, 0], [NAN, 0, 0], [0, 1, 0], [0, 0, 1])),
        "/shapes/0/axes/0/0",
        FINITE,
    ),
    ("coordinate 1e308", shown(sphere([0, 1e308, 0], 1)), "/shapes/0/center/1", "at most 1e15"),
    ("coordinate -infinity", shown(sphere([0, -math.inf, 0], 1)), "/shapes/0/center/1", FINITE),
    ("vertex NaN", shown(triangle([0, 0, NAN], *CORNERS[1:])), "/shapes/0/vertices/0/2", FINITE),
    ("uv NaN", shown(triangle(*CORNERS, uvs=[[0, NAN], [1, 0], [0, 1]])), "/shapes/0/uvs/0/1", FINITE),
    (
        "vertex of a mesh NaN",
        shown(mesh(vertices=[[0, 0, NAN], *CORNERS[1:]])),
        "/shapes/0/vertices/0/2",
        FINITE,
    ),
    (
        "vertex normal of no length",
        shown(triangle(*CORNERS, normals=[[0, 0, 1], [0, 0, 0], [0, 0, 1]])),
        "/shapes/0/normals/1",
        "other than 0",
    ),
    (
        "light edge of no length",
        shown(lights=[lamp([0, 5, 0], [0, 0, 0], [0, 0, 1])]),
        "/lights/0/edges/0",
        "longer",
    ),
    ("sun without direction", shown(lights=[sun([0, 0, 0])]), "/lights/0/direction", "other than 0"),
    ("light colour NaN", shown(lights=[bulb([0, 5, 0], [1, NAN, 1])]), "/lights/0/color/1", FINITE),
    ("negative light", shown(lights=[bulb([0, 5, 0], [1, -1, 1])]), "/lights/0/color/1", "at least 0"),
    ("shininess -1", painted(shininess=-1), "/materials/plain/shininess", "at least 0"),
    ("index 0", painted(transmission=1, ior=0), "/materials/plain/ior", "1e-100 or more"),
    ("mirror of 1.5", painted(mirror=1.5), "/materials/plain/mirror", "at most 1"),
    ("65 bounces", painted(mirror=1, max_depth=65), "/materials/plain/max_depth", "at most 64"),
    ("exposure infinite", shown(display={"exposure": math.inf}), "/display/exposure", FINITE),
]

ACCEPTED: list[tuple[str, Json, str | None]] = [
    ("up along the view", seen(position=[0, 5, 0], look_at=[0, 0, 0]), "up_parallel_to_view"),
    (
        "up against the view",
        seen(position=[0, 5, 0], look_at=[0, 0, 0], up=[0, -5, 0]),
        "up_parallel_to_view",
    ),
    ("up nearly along the view", seen(position=[0, 5, 0], look_at=[1e-4, 0, 0]), None),
    ("up of length 1e-320", seen(up=[0, 1e-320, 0]), None),
    ("up of length 1e15", seen(up=[0, 1e15, 0]), None),
    ("view of 1e-3 degrees", seen(vertical_fov=1e-3, look_at=[0.1, 0, 0]), None),
    ("view of 179.99 degrees", seen(vertical_fov=179.99), None),
    ("one row", seen(width=96, height=1), None),
    ("one column", seen(width=1, height=54), None),
    ("one pixel", seen(width=1, height=1, look_at=[0.1, 0, 0]), None),
    ("focal length 1e-30", seen(focal_length=1e-30), None),
    ("focal length 1e15", seen(focal_length=1e15), None),
    ("triangle on a line", shown(triangle([0, 0, 0], [1, 1, 1], [3, 3, 3])), "no_area"),
    ("triangle in a point", shown(triangle([1, 1, 1], [1, 1, 1], [1, 1, 1])), "no_area"),
    ("triangle of 1e-15", shown(triangle([0, 0, 0], [1e-15, 0, 0], [0, 1e-15, 0])), None),
    ("triangle of 1e15", shown(triangle([-1e15, 0, -9], [1e15, 0, -9], [0, 1e15, -9])), "very_large"),
    ("needle", shown(triangle([0, 0, 0], [1e-6, 0, 0], [0, 1, 0])), None),
    ("rectangle of 1e-12", shown(rectangle([0, 0, 0], [1e-12, 0, 0], [0, 1e-12, 0])), None),
    ("rectangle of 1e12", shown(rectangle([-5e11, 0, -5], [1e12, 0, 0], [0, 1e12, 0])), None),
    ("rectangle of 1 to 1e6", shown(rectangle([-5e5, 1, 0], [1e6, 0, 0], [0, 1, 0])), None),
    ("skew rectangle", shown(rectangle([0, 0, 0], [1, 0, 0], [1, 0.1, 0])), None),
    ("ball of a million as ground", shown(sphere([0, -1e6, 0], 1e6)), None),
    ("ball of 1e-100", shown(sphere([0, 1, 0], 1e-100)), None),
    ("disc of 1 to 1e-6", shown(ellipsoid([0, 1, 0], [1, 0, 0], [0, 1e-6, 0], [0, 0, 1])), None),
    ("disc of 1 to 1e-9", shown(ellipsoid([0, 1, 0], [1, 0, 0], [0, 1e-9, 0], [0, 0, 1])), "very_flat"),
    ("coordinate 1e15", shown(sphere([0, 0, -1e15], 9e14)), None),
    ("light in the floor", shown(lights=[lamp([0, 0, 0], [1, 0, 0], [0, 0, 1])]), None),
    ("light beside the floor", shown(lights=[lamp([5, 0, 0], [1, 0, 0], [0, 0, 1])]), None),
    ("light that stands on the floor", shown(lights=[lamp([0, 0, 0], [1, 0, 0], [0, 1, 0])]), None),
    ("light below the floor", shown(lights=[bulb([0, -1, 0])]), None),
    ("light in a ball", shown(sphere([0, 1, 0], 1), lights=[bulb([0, 1, 0])]), "light_inside"),
    ("light of radiance 1e30", shown(lights=[bulb([0, 5, 0], [1e30, 1e30, 1e30])]), None),
    ("no light", shown(lights=[]), "no_light"),
    ("nothing but black", shown(lights=[], ambient=[0, 0, 0]), "black_picture"),
    ("shininess 0", painted(specular=0.5, shininess=0), None),
    ("shininess 50.5", painted(specular=0.5, shininess=50.5), None),
    ("shininess 1e7", painted(specular=0.5, shininess=1e7), None),
    ("index 1", painted(transmission=1, ior=1), None),
    (
        "facing mirrors",
        shown(rectangle([-4, 2, -4], [8, 0, 0], [0, 0, 9]), materials={"plain": phong(mirror=1)}),
        None,
    ),
    ("same faces twice", shown(FLOOR, FLOOR), None),
    ("uv of a thousand million", shown(triangle(*CORNERS, uvs=[[1e9, -1e9], [1e9 + 1, 0], [0, 1e9]])), None),
    ("one light point", shown(sampling=sampled(1, 1, "random", "random")), None),
]


@pytest.mark.parametrize(
    ("document", "pointer", "cure"), [row[1:] for row in REFUSED], ids=[row[0] for row in REFUSED]
)
def test_what_makes_no_scene_is_refused_at_its_place_with_a_cure(
    document: Json, pointer: str, cure: str
) -> None:
    with pytest.raises(SceneError) as caught:
        read_scene(document)
    (problem,) = caught.value.errors
    assert problem.pointer == pointer
    assert cure in problem.detail


@pytest.mark.parametrize(
    ("document", "warning"), [row[1:] for row in ACCEPTED], ids=[row[0] for row in ACCEPTED]
)
def test_what_makes_a_scene_is_drawn_with_its_warning_alone(document: Json, warning: str | None) -> None:
    loaded = renderer.load_scene(document)
    assert [problem.code for problem in loaded.warnings] == ([warning] if warning else [])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = renderer.render(renderer.compile_scene(loaded))
    assert np.isfinite(result.image).all()
    assert result.report["numerics"]["non_finite"] == 0
