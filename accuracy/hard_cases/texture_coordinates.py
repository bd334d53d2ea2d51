"""Hard cases: texture coordinates at poles, and textures with fields smaller than pixels."""

from typing import Any

import numpy as np

from accuracy.hard_cases.cases import Outcome, Section, total
from accuracy.hard_cases.documents import Json, camera, phong, sampled, scene, sphere, triangle
from accuracy.hard_cases.rays_seen import plan_of, png, points
from renderer.math.arrays import Floats

SECTION = Section("Texture coordinates")

EPS = float(np.finfo(np.float64).eps)
UP = np.array([[0.0], [1.0], [0.0]])


def mapped(*shapes: Json, codes: np.ndarray, filter_: str = "nearest", **material: Any) -> Any:
    """The plan of shapes with an image `map` of codes (H, W, 3)."""
    textures = {"map": {"type": "image", "asset": "map", "encoding": "linear", "filter": filter_}}
    textures["map"]["wrap"] = "clamp"
    document = scene(*shapes, textures=textures, materials={"plain": phong(**material)})
    return plan_of(document, files={"map": png(codes.astype(np.uint8))})


ROWS = np.arange(20, 240, 20)
"""Codes of the rows of an image, the first on the side v = 1."""


@SECTION.case(
    "the poles of a ball",
    symptom="A pixel of a wrong colour, an IndexError, or NaN where a textured ball has its poles.",
    cause="There the cosine of the latitude rounds to above 1, whose angle is NaN, and NaN as a whole number "
    "is -2^63.",
    remedy="Latitude and longitude come from atan2, which has an answer for every direction.",
    expected="The colour of the first or last row of the texture, exactly, at the poles and 1e-9 beside "
    "them.",
    source="geometry",
)
def poles() -> Outcome:
    """Many balls, and rays aimed at both poles of each from within 60 degrees of the axis."""
    rng = np.random.default_rng(1)
    count = 170
    centers = np.stack((10.0 * np.arange(count), rng.uniform(-3, 3, count), rng.uniform(-3, 3, count)))
    radii = rng.uniform(0.3, 3, count)
    balls = [sphere(c.tolist(), float(r)) for c, r in zip(centers.T, radii, strict=True)]
    codes = np.repeat(ROWS[:, None, None], 3, axis=2).repeat(5, axis=1)
    plan = mapped(*balls, codes=codes, filter_="bilinear", color_texture="map")
    parts = []
    for side in (1.0, -1.0):
        for widest in (0.0, 0.5, 1.5):
            across = rng.uniform(-widest, widest, (2, count))
            directions = np.stack((*across, np.full(count, -side)))
            origins = centers + np.array([[0.0], [0.0], [side]]) * radii - 2 * radii * directions
            met = points(plan, origins, directions)
            expected = float(np.float32(ROWS[0 if side > 0 else -1] / 255))
            parts.append(
                Outcome(
                    count,
                    wrong=int(np.count_nonzero(met.colors[0] != expected)) + count - met.count,
                    textbook=_outside(origins, directions, centers, radii, np.float64),
                    textbook_single=_outside(origins, directions, centers, radii, np.float32),
                )
            )
    return total(parts)


def _outside(origins: Floats, directions: Floats, centers: Floats, radii: Floats, kind: Any) -> int:
    """How many latitudes, as the arc cosine of a height, are no number from 0 to below 1."""
    o, d, c, r = (values.astype(kind) for values in (origins, directions, centers, radii))
    away = o - c
    squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    half = away[0] * d[0] + away[1] * d[1] + away[2] * d[2]
    rest = away[0] * away[0] + away[1] * away[1] + away[2] * away[2] - r * r
    t = (-half - np.sqrt(half * half - squared * rest)) / squared
    height = (o[2] + t * d[2] - c[2]) / r
    with np.errstate(invalid="ignore"):
        latitudes = np.arccos(-height) / kind(np.pi)
        return int(np.count_nonzero(~((latitudes >= 0) & (latitudes < 1))))


FIELDS = 4
"""Least width of a footprint, in fields of the board, where the case asks for its mean."""


def board(texture: Json, repeats: float) -> Json:
    """A board to the horizon: a triangle of 1200 units with texture coordinates up to `repeats`."""
    ground = triangle(
        [-600, 0, 100], [600, 0, 100], [-600, 0, -1100], uvs=[[0, 0], [repeats, 0], [0, repeats]]
    )
    view = camera(position=[-150.3, 1.7, 99], look_at=[-150, 1.2, 0], width=48, height=48)
    return scene(
        ground,
        camera=view,
        textures={"map": texture},
        materials={"plain": phong(color_texture="map")},
        sampling=sampled(pattern="center"),
    )


@SECTION.case(
    "fields smaller than pixels",
    symptom="A board to the horizon has moire patterns that crawl when the camera moves.",
    cause="A look-up at a point takes one field for all that a pixel covers.",
    remedy="The filters `box` and `mipmap` take the mean over what a sample of the pixel covers; without "
    "them more samples are needed.",
    expected="Where a pixel covers at least 4 fields each way, the mean 1/2 within 1/32: a mean over w "
    "fields of a wave of +1 and -1 is at most 1 / w.",
    source="Igehy 1999; Williams 1983",
)
def small_fields() -> Outcome:
    """One board as a checker and as an image of two by two texels, with and without its filter."""
    checker = {"type": "checker", "even": [1, 1, 1], "odd": [0, 0, 0], "repeat": [2, 2]}
    image = {"type": "image", "asset": "map", "encoding": "linear", "wrap": "repeat"}
    codes = np.array([[0, 255], [255, 0]])[:, :, None].repeat(3, axis=2).astype(np.uint8)
    parts = []
    for texture, filtered, unfiltered in ((checker, "box", "none"), (image, "mipmap", "nearest")):
        wrong = []
        for kind in (filtered, unfiltered):
            plan = plan_of(board({**texture, "filter": kind}, 6000), files={"map": png(codes)})
            rows, columns = np.divmod(np.arange(48 * 48, dtype=np.float64), 48)
            met = points(plan, plan.camera.position, plan.camera.directions(columns + 0.5, rows + 0.5))
            # A field is 0.1 units wide; the middle of the picture has the narrowest pixels.
            far = met.t >= FIELDS * 0.1 / (2 * plan.camera.half_width / 48)
            wrong.append(int(np.count_nonzero(np.abs(met.colors[0, far] - 0.5) > 1 / 32)))
            tried = int(np.count_nonzero(far))
        parts.append(Outcome(tried, wrong=wrong[0], textbook=wrong[1]))
    return total(parts)
