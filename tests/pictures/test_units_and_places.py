"""Whole pictures: in other units, elsewhere, turned, and in both precisions."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

import renderer
from renderer.integrator import intersect, workspace
from renderer.interaction import Points, Rays
from renderer.plan.building import compile_visibility
from renderer.plan.stages import Lighting
from renderer.waves import camera_wave
from tests.documents import Json, bulb, camera, ellipsoid, lamp, mesh, phong, rectangle, sampled, scene, sun
from tests.numerics.tracing import QUALITIES
from tests.pictures import pictures
from tests.pictures.parts import DOUBLE, SINGLE, plan_of, png
from tests.pictures.pictures import FLOOR
from tests.solids import outward

Floats = np.ndarray


def waves_of_color(means: tuple[float, float, float], depth: float) -> bytes:
    """A PNG file whose colours change slowly, so that no texel is an edge."""
    y, x = np.mgrid[:12, :16] / 16
    channels = [
        mean + depth * np.sin(6 * x + shift) * np.cos(5 * y - shift) for shift, mean in enumerate(means)
    ]
    return png(np.round(255 * np.stack(channels, axis=2)).astype(np.uint8))


FILES = {
    "waves.png": waves_of_color((0.5, 0.5, 0.5), 0.3),
    "normals.png": waves_of_color((0.5, 0.5, 0.9), 0.1),
}
WAVES = {
    name: {"type": "image", "asset": f"{name}.png", "encoding": "linear", "wrap": "repeat"}
    for name in ("waves", "normals")
}
CEILING_LAMP = lamp([-0.5, 3.9, -0.5], [1, 0, 0], [0, 0.1, 1])
VIEW = camera(width=48, height=32)


def mesh_on_a_board() -> Json:
    """A smooth mesh of many triangles on a checker board, by a bulb, the sun, and Sobol points of a lamp."""
    ball = mesh(*outward([0.2, 1.2, 0.1], 1.0, 2), material="shiny", smooth=True)
    materials = {
        "plain": phong(color_texture="board"),
        "shiny": phong([0.3, 0.5, 0.7], specular=0.4, shininess=300),
    }
    return scene(
        FLOOR,
        ball,
        camera=VIEW,
        lights=[CEILING_LAMP, bulb([2.2, 2.1, 1.4]), sun([0.3, -1, -0.6])],
        materials=materials,
        textures={"board": {"type": "checker", "repeat": [9, 9], "filter": "box"}},
        sampling=sampled(1, 9, light="sobol", seed=3),
    )


def carved_and_blurred() -> Json:
    """Bump, normal and displacement maps before a camera with a lens."""
    materials = {
        "plain": phong(bump_map="waves", bump_height=0.05),
        "raised": phong([0.3, 0.7, 0.5], displacement_map="waves", displacement_height=0.3),
        "bent": phong(color_texture="waves", normal_map="normals", specular=0.3),
    }
    return scene(
        FLOOR,
        rectangle([-1.8, 0.3, -0.5], [1.7, 0, 0.2], [0.1, 1.8, 0], material="raised"),
        ellipsoid([0.9, 1.1, 0.2], [0.8, 0.1, 0], [-0.1, 0.8, 0], [0, 0, 0.9], material="bent"),
        camera=camera(width=48, height=32, lens_radius=0.05, focus_distance=6),
        lights=[CEILING_LAMP],
        materials=materials,
        textures=WAVES,
        sampling=sampled(4, 4, "random", "random", seed=9),
    )


SCENES: dict[str, Callable[[], Json]] = {
    "every shape": lambda: pictures.many_lights() | {"camera": VIEW},
    "mesh on a board": mesh_on_a_board,
    "mirror and glass": pictures.mirror_and_glass,
    "carved and blurred": carved_and_blurred,
}

PLACES = {"corner", "center", "position", "look_at", "vertices"}
VECTORS = {"edges", "axes"}
DIRECTIONS = {"up", "normal", "tangent", "direction", "normals"}
LENGTHS = {"radius", "size", "lens_radius", "focus_distance", "bump_height", "displacement_height"}

QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""A quarter turn about z, exact."""


def turn(degrees: float, axis: tuple[float, float, float] = (0.6, 0.48, 0.64)) -> Floats:
    """The matrix (3, 3) of a turn about a unit vector, to rounding."""
    x, y, z = axis
    angle = np.radians(degrees)
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * across + (1 - np.cos(angle)) * across @ across


def placed(document: Json, scale: float = 1.0, offset: float = 0.0, turned: Floats | None = None) -> Json:
    """A scene turned about the origin, then moved along (1, -1, 1), then scaled.

    Point lights with physical falloff would need other colours, and meshes of files another `translate`:
    neither is looked after.
    """
    matrix = np.eye(3) if turned is None else turned
    away = np.array([offset, -offset, offset])

    def each(vectors: Any) -> Floats:
        # Each component is a sum over its own row alone.
        given = np.asarray(vectors, dtype=np.float64)
        return np.stack([(given * row).sum(axis=-1) for row in matrix], axis=-1)

    changes: Any = {
        **dict.fromkeys(PLACES, lambda x: (each(x) + away) * scale),
        **dict.fromkeys(VECTORS, lambda x: each(x) * scale),
        **dict.fromkeys(DIRECTIONS, each),
        **dict.fromkeys(LENGTHS, lambda x: np.asarray(x) * scale),
    }

    def part(item: Json) -> Json:
        return {k: changes[k](v).tolist() if k in changes else v for k, v in item.items()}

    return {
        **document,
        "camera": part({"up": [0, 1, 0], **document["camera"]}),
        "materials": {name: part(item) for name, item in document["materials"].items()},
        "shapes": [part(item) for item in document["shapes"]],
        "lights": [part(item) for item in document["lights"]],
    }


def on_edges(plan: renderer.RenderPlan) -> Floats:
    """Pixels (H, W) whose own rays do not all see the same.

    Nine rays go through each pixel: through its corners, the middles of its sides, and its centre. They see
    the same if all of them, and all rays that mirrors and glass send on from them, hit the same triangle or
    other shape, and see the same share of every light from there.
    """
    size, nothing = plan.width * plan.height, -2.0
    pixels = np.arange(size).repeat(9)
    down, across = np.divmod(np.tile(np.arange(9), size), 3)
    samples = np.zeros_like(pixels)
    x, y = pixels % plan.width + across / 2, pixels // plan.width + down / 2
    origins, directions = plan.camera.rays(x, y, pixels, samples)
    lights = compile_visibility(plan)
    differ = np.zeros(size, dtype=bool)
    waiting = [camera_wave(Rays(origins, directions, pixels, samples))]
    while waiting:
        wave = waiting.pop()
        points = intersect(plan, wave.rays)
        seen = [wave.rays.shapes, wave.rays.primitives]
        for light in lights:
            shares = np.full(wave.rays.t.size, nothing)
            shares[points.rays] = _shares(light, points)
            seen.append(shares)
        for row in seen:
            of_all = np.full(9 * size, nothing)
            of_all[wave.targets] = row
            nine = of_all.reshape(size, 9)
            differ |= (nine != nine[:, :1]).any(axis=1)
        for stage in plan.scattering:
            waiting.extend(stage.run(points, wave))
    return differ.reshape(plan.height, plan.width)


def _shares(light: Lighting, points: Points) -> Floats:
    """Share of a light's points that each point sees above its horizon, (M,)."""
    shares = np.zeros(points.count)
    view = light.view(points, workspace())
    if view.count:
        visible = view.above_horizon(view.of_points(points.normals))
        if view.blocked is not None:
            visible &= ~view.blocked
        shares[view.chosen] = visible.mean(axis=0)
    return shares


CODE = 1 / 255
EVERY = pytest.mark.parametrize("name", SCENES)


def drawn(document: Json, quality: Any = None, **options: Any) -> Any:
    return renderer.render(plan_of(document, quality, files=FILES), **options).image


@cache
def edges_of(name: str) -> Any:
    return on_edges(plan_of(SCENES[name](), files=FILES))


@cache
def image_at_home(name: str, quality: Any) -> Any:
    return drawn(SCENES[name](), quality)


def check(image: Any, expected: Any, edges: Any, share: float) -> None:
    """Pixels look the same off all edges, and on them but for a share of the picture."""
    changed = ~(np.abs(image - expected).max(axis=2) <= CODE)
    assert not (changed & ~edges).any()
    assert changed.sum() <= share * edges.size


@EVERY
@pytest.mark.parametrize("quality", QUALITIES, ids=["single", "double"])
@pytest.mark.parametrize("power", [-300, 40])
def test_unit_of_a_power_of_two_changes_no_byte(power: int, quality: Any, name: str) -> None:
    assert (
        drawn(placed(SCENES[name](), 2.0**power), quality).tobytes() == image_at_home(name, quality).tobytes()
    )


CHANGES: dict[str, tuple[Callable[[Json], Json], float]] = {
    "a millionth": (lambda document: placed(document, 1e-6), 0.001),
    "a million times": (lambda document: placed(document, 1e6), 0.001),
    "a million away": (lambda document: placed(document, offset=1e6), 0.001),
    "turned by 37 degrees": (lambda document: placed(document, turned=turn(37)), 1.0),
}


@EVERY
@pytest.mark.parametrize("change", CHANGES)
def test_unit_place_and_direction_change_edges_alone(change: str, name: str) -> None:
    altered, share = CHANGES[change]
    check(drawn(altered(SCENES[name]()), SINGLE), image_at_home(name, SINGLE), edges_of(name), share)


@pytest.mark.parametrize(("number", "name"), list(enumerate(SCENES)), ids=list(SCENES))
def test_quarter_turn_changes_no_byte_in_double_precision(number: int, name: str) -> None:
    other = placed(SCENES[name](), turned=np.roll(QUARTER, number % 3, axis=(0, 1)))
    assert (drawn(other, DOUBLE) == image_at_home(name, DOUBLE)).all()
    assert np.abs(drawn(other, SINGLE) - image_at_home(name, SINGLE)).max() <= 2.0**-20


@EVERY
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_precision_changes_edges_alone(offset: float, name: str) -> None:
    document = placed(SCENES[name](), offset=offset)
    check(drawn(document, SINGLE), drawn(document, DOUBLE), on_edges(plan_of(document, files=FILES)), 0.005)
