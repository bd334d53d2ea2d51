"""Make the scenes and textures of the ready assignment.

Run it with ``python -m scenes.make_assignment``. It uses no random numbers, so it writes the same files
every time.
"""

from __future__ import annotations

import math

import numpy as np
from PIL import Image

from scenes.make_assignment_parts import (
    DAY,
    FOLDER,
    Json,
    ball,
    black,
    camera,
    ellipsoid,
    matte,
    phong,
    scene,
    triangle,
)
from scenes.make_hard_scenes import rectangle, text


def camera_straight() -> Json:
    """Black balls on a bright background, seen along an axis: only their positions are visible."""
    balls = [
        ball([-3.0, 1.9, -1.0], 0.5, "black"),
        ball([-1.3, 2.1, 0.4], 0.3, "black"),
        ball([1.0, 1.4, -2.0], 0.8, "black"),
        ball([2.9, 1.9, 0.0], 0.4, "black"),
        ball([-2.6, 0.1, 0.8], 0.6, "black"),
        ball([0.0, 0.0, 0.0], 0.35, "black"),
        ball([1.9, -0.2, 1.0], 0.45, "black"),
        ball([-3.2, -2.0, 0.0], 0.4, "black"),
        ball([-0.9, -1.6, 1.0], 0.5, "black"),
        ball([1.2, -2.2, -1.0], 0.6, "black"),
        ball([3.1, -1.9, 0.3], 0.35, "black"),
    ]
    view = camera([0, 0, 6], [0, 0, 0], 50)
    return scene("camera_straight", view, balls, materials=black(), background=DAY)


def camera_tilted() -> Json:
    """Similar balls seen from the side, with a rolled camera and a wide field of view."""
    balls = [
        ball([2.6 * x, 2.2 * y, 1.8 * z], 0.35 + 0.1 * ((x + 2 * y + z) % 3), "black")
        for x in (-1, 0, 1)
        for y in (-1, 0, 1)
        for z in (-2, -1, 0)
    ]
    view = camera([3.0, 2.4, 4.6], [0.3, -0.2, -0.6], 64) | {"up": [0.45, 1, 0.1]}
    return scene("camera_tilted", view, balls, materials=black(), background=DAY)


def phong_matte() -> Json:
    """Ambient and diffuse terms on every kind of shape, without highlights or visible shadows.

    The second light is behind the triangle and the rectangle, which must block it. A program that draws the
    last shape hit draws the black sheet behind them all.
    """
    shapes = [
        ball([-2.1, 0.9, 0], 0.95, "red"),
        ellipsoid([1.9, 1.0, 0], [[1.6, 0.4, 0], [-0.14, 0.56, 0], [0, 0, 0.7]], "green"),
        triangle([-3.0, -1.9, 0.5], [-0.6, -2.0, -0.3], [-1.5, -0.3, 0.2], "yellow"),
        rectangle([0.5, -2.0, 0.4], [2.0, 0.2, -0.8], [0.1, 1.6, 0.3], "blue"),
        rectangle([-5.5, -3.5, -6.0], [10.0, 0, 0], [0, 5.9, 0], "black"),
    ]
    lights = [
        {"type": "directional", "direction": [-0.6, -0.5, -0.8], "color": [0.7, 0.65, 0.6]},
        {"type": "point", "position": [-1.0, 3.0, -4.0], "color": [0.5, 0.55, 0.6]},
    ]
    view = camera([0, 0, 8], [0, 0, 0], 38)
    return scene("phong_matte", view, shapes, lights, materials=matte() | black())


def phong_highlights() -> Json:
    """Highlights from wide to narrow on dark balls and on a sheet at a low angle, before a black sheet.

    The second light is behind the viewer: the low sheet reflects it away from the viewer, so that r . v < 0.
    """
    shine = {"wide": 4, "middle": 20, "narrow": 120}
    materials = {
        name: phong(color, specular=0.7, shininess=shine[name])
        for name, color in zip(shine, ([0.3, 0.05, 0.05], [0.05, 0.2, 0.05], [0.05, 0.1, 0.3]), strict=True)
    }
    shapes = [
        ball([-2.15, 0.9, 0], 1.0, "wide"),
        ball([0.1, -0.8, 0], 1.15, "middle"),
        ellipsoid([2.1, 0.9, 0], [[1.2, 0, 0.6], [0, 0.7, 0], [-0.3, 0, 0.6]], "narrow"),
        rectangle([-3.0, -2.3, 1.2], [2.0, 0, 0], [0, 0.35, -3.0], "wide"),
        rectangle([-5.0, -3.0, -4.0], [10.0, 0, 0], [0, 6.5, 0], "black"),
    ]
    lights = [
        {"type": "point", "position": [-4.0, 4.0, 5.0], "color": [0.9, 0.9, 0.9]},
        {"type": "point", "position": [1.0, 1.0, 9.0], "color": [0.5, 0.5, 0.3]},
    ]
    view = camera([0, 0, 8], [0, 0, 0], 38)
    return scene("phong_highlights", view, shapes, lights, materials=materials | black())


ROOM_VIEW = camera([1.5, 4.6, 8.0], [0.2, 0.8, 0.0], 36)


def room() -> list[Json]:
    """Three shapes before a floor and a wall, and a sheet above the lights, out of view.

    What is farther from the camera comes later, so that a program that draws the last shape hit is wrong.
    """
    return [
        ball([-1.3, 1.2, 0.4], 0.7, "red"),
        ellipsoid([1.3, 1.0, 1.2], [[0.9, 0, 0.2], [0, 0.35, 0], [-0.1, 0, 0.45]], "green"),
        triangle([-0.6, 1.7, -1.3], [2.3, 1.9, -1.5], [1.2, 2.5, 0.1], "yellow"),
        rectangle([-5, 0, -3], [0, 0, 8], [10, 0, 0], "white"),
        rectangle([-5, 0, -3], [10, 0, 0], [0, 4.5, 0], "violet"),
        rectangle([-9, 7.8, -7], [18, 0, 0], [0, 0, 16], "blue"),
    ]


def shadow_hard() -> Json:
    """A point light over a ball, a triangle and an ellipsoid: each casts a sharp shadow."""
    lights = [{"type": "point", "position": [-2.2, 7.0, 2.5], "color": [0.85, 0.85, 0.85]}]
    return scene("shadow_hard", ROOM_VIEW, room(), lights, materials=matte())


def shadow_soft() -> Json:
    """A square light over the same room; the sheet above the light casts no shadow."""
    lamp = {
        "type": "rectangle",
        "corner": [-4.0, 7.0, 0.7],
        "edges": [[3.6, 0, 0], [0, 0, 3.6]],
        "color": [0.85, 0.85, 0.85],
        "visible": False,
    }
    return scene("shadow_soft", ROOM_VIEW, room(), [lamp], materials=matte())


def antialiasing() -> Json:
    """A star of narrow black triangles, so that most pixels are on an edge."""
    spokes = []
    for number in range(20):
        angle, half = 2 * math.pi * (number + 0.3) / 20, 0.075
        left, right = ([2.6 * math.cos(a), 2.6 * math.sin(a), 0.0] for a in (angle - half, angle + half))
        spokes.append(triangle([0.0, 0.0, 0.0], left, right, "black"))
    view = camera([0.1, 0.1, 7], [0.1, 0.1, 0], 41)
    return scene("antialiasing", view, spokes, materials=black(), background=DAY)


def antialiasing_advanced() -> Json:
    """Nearly horizontal or vertical bars: an axis-aligned grid of 16 samples shows four steps on each."""
    bars = []
    for number in range(12):
        along = -3.1 + 0.56 * number
        slope = 0.008 + 0.004 * number
        level, upright = [3.4, 3.4 * slope, 0], [5 * slope, 5, 0]
        bars.append(rectangle([-3.6, along * 0.8, 0], level, [-0.2 * slope, 0.2, 0], "black"))
        bars.append(rectangle([0.2 + 0.29 * number, -2.5, 0], upright, [0.11, 0, 0], "black"))
    view = camera([0, 0, 7], [0, 0, 0], 40)
    return scene("antialiasing_advanced", view, bars, materials=black(), background=DAY)


def texture() -> Json:
    """A picture on a rotated sheet and a checker on another; the picture has no symmetry.

    Light from the front shows their colours without ambient light. Black sheets are hidden behind them from a
    program that draws the nearest shape.
    """
    materials = {
        "sheet": {"type": "phong", "color_texture": "arrow", "ambient": 0, "diffuse": 1},
        "board": {"type": "phong", "color_texture": "board", "ambient": 0, "diffuse": 1},
    } | black()
    textures = {
        "arrow": {"type": "image", "asset": "textures/arrow.png", "encoding": "srgb", "filter": "bilinear"},
        "board": {"type": "checker", "even": [0.7, 0.65, 0.5], "odd": [0.1, 0.15, 0.3], "repeat": [7, 4]},
    }
    shapes = [
        rectangle([-3.2, -1.9, 0.3], [3.0, 0.25, -0.8], [-0.15, 3.6, 0.2], "sheet"),
        rectangle([0.5, -1.6, -0.6], [2.6, -0.2, 1.0], [0.2, 3.3, 0], "board"),
        rectangle([-3.0, -1.4, -1.5], [2.2, 0, 0], [0, 2.6, 0], "black"),
        rectangle([1.2, -1.2, -1.5], [1.6, 0, 0], [0, 2.2, 0], "black"),
    ]
    made = scene("texture", camera([0, 0, 7], [0, 0, 0], 40), shapes, materials=materials)
    return {**made, "textures": textures}


def normal_map() -> Json:
    """Studs on a flat sheet: light from the upper left shows whether they are raised.

    A black sheet is hidden behind it.
    """
    materials = {"sheet": phong([0.6, 0.55, 0.45]) | {"normal_map": "studs"}} | black()
    textures = {"studs": {"type": "image", "asset": "textures/studs_normal.png", "encoding": "linear"}}
    shapes = [
        rectangle([-3.0, -2.1, 0.4], [6.0, 0.3, -0.8], [0.1, 4.2, 0.2], "sheet"),
        rectangle([-2.2, -1.4, -1.5], [4.4, 0, 0], [0, 3.0, 0], "black"),
    ]
    lights = [{"type": "directional", "direction": [0.36, -0.28, -0.89], "color": [0.9, 0.9, 0.9]}]
    made = scene("normal_map", camera([0, 0, 7], [0, 0, 0], 40), shapes, lights, materials=materials)
    return {**made, "textures": textures}


PICTURES = {
    make.__name__: make
    for make in (
        camera_straight,
        camera_tilted,
        phong_matte,
        phong_highlights,
        shadow_hard,
        shadow_soft,
        antialiasing,
        antialiasing_advanced,
        texture,
        normal_map,
    )
}
"""Scenes that students render as pictures."""


def arrow() -> np.ndarray:
    """Colour codes (64, 64, 3): an arrow to the upper right on four fields of different colours."""
    y, x = np.mgrid[63.5:0:-1, 0.5:64] / 64
    fields = np.array([[[0.75, 0.6, 0.3], [0.35, 0.6, 0.45]], [[0.35, 0.4, 0.65], [0.6, 0.35, 0.4]]])
    colors = fields[(y > 0.5).astype(int), (x > 0.4).astype(int)]
    along, across = (x + y) / 2, np.abs(x - y)
    head = (along > 0.55) & (along < 0.85) & (across < (0.85 - along) * 1.2)
    shaft = (along > 0.15) & (along <= 0.55) & (across < 0.1)
    codes: np.ndarray = np.where((head | shaft)[..., None], 235, np.round(255 * colors)).astype(np.uint8)
    return codes


def studs() -> np.ndarray:
    """Normals (64, 64, 3) as colour codes: domes of several sizes, one of them a dent."""
    v, u = np.mgrid[63.5:0:-1, 0.5:64] / 64
    slopes = np.zeros((2, 64, 64))
    domes = ((0.22, 0.75, 0.17, 1), (0.62, 0.7, 0.22, 1), (0.3, 0.28, 0.2, 1), (0.75, 0.25, 0.15, -1))
    for left, low, radius, side in domes:
        along, up = (u - left) / radius, (v - low) / radius
        height = np.sqrt(np.maximum(1 - along**2 - up**2, 0))
        inside = height > 0
        slopes += np.where(inside, side * np.stack((along, up)) * 0.75, 0)
    normals = np.stack((*slopes, np.sqrt(1 - (slopes**2).sum(axis=0))), axis=-1)
    codes: np.ndarray = np.round(127.5 * (normals + 1)).astype(np.uint8)
    return codes


def main() -> None:
    """Write all scenes and textures."""
    (FOLDER / "textures").mkdir(parents=True, exist_ok=True)
    for name, picture in (("arrow", arrow()), ("studs_normal", studs())):
        Image.fromarray(picture).save(FOLDER / "textures" / f"{name}.png", optimize=True)
    for name, make in PICTURES.items():
        FOLDER.joinpath(f"{name}.json").write_text(text(make()) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
