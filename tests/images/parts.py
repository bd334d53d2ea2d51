"""Parts of scenes as a user writes them, and the short way from a scene to its pixels."""

import io
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import renderer
from renderer.execute import camera_rays, radiance
from renderer.tiling import blocks
from schemas.quality import FixedQuality
from schemas.tiles import Pass, Tile

Json = dict[str, Any]
DOUBLE = FixedQuality(mode="fixed", precision="double")
SINGLE = FixedQuality(mode="fixed", precision="single")


def camera(**changes: Any) -> Json:
    return {
        "position": [0.3, 1.7, 6.1],
        "look_at": [0.1, 1.4, 0],
        "vertical_fov": 44,
        "width": 24,
        "height": 16,
        **changes,
    }


def phong(color: list[float] | None = None, **changes: Any) -> Json:
    base = {} if "color_texture" in changes else {"color": color or [0.8, 0.7, 0.6]}
    return {"type": "phong", **base, "ambient": 0.2, "diffuse": 0.9, **changes}


def rectangle(corner: list[float], first: list[float], second: list[float], **changes: Any) -> Json:
    return {"type": "rectangle", "corner": corner, "edges": [first, second], "material": "plain", **changes}


def triangle(*vertices: list[float], **changes: Any) -> Json:
    return {"type": "triangle", "vertices": list(vertices), "material": "plain", **changes}


def sphere(center: list[float], radius: float, **changes: Any) -> Json:
    return {"type": "ellipsoid", "center": center, "radius": radius, "material": "plain", **changes}


def ellipsoid(center: list[float], *axes: list[float], **changes: Any) -> Json:
    return {"type": "ellipsoid", "center": center, "axes": list(axes), "material": "plain", **changes}


def lamp(
    corner: list[float], first: list[float], second: list[float], color: Any = (0.9, 0.8, 0.7), **more: Any
) -> Json:
    return {"type": "rectangle", "corner": corner, "edges": [first, second], "color": list(color), **more}


def bulb(position: list[float], color: Any = (0.5, 0.6, 0.7)) -> Json:
    return {"type": "point", "position": position, "color": list(color)}


def sun(direction: list[float], color: Any = (0.4, 0.3, 0.5)) -> Json:
    return {"type": "directional", "direction": direction, "color": list(color)}


def sampled(
    samples: int = 1, points: int = 1, pattern: str = "uniform", light: str = "uniform", seed: int = 0
) -> Json:
    return {
        "antialiasing": {"pattern": pattern, "samples": samples},
        "light": {"pattern": light, "samples": points},
        "seed": seed,
    }


def scene(*shapes: Json, lights: Any = (), **changes: Any) -> Json:
    return {
        "version": 1,
        "camera": camera(),
        "background": [0.05, 0.1, 0.2],
        "ambient": [1, 0.9, 0.8],
        "materials": {"plain": phong()},
        "shapes": list(shapes),
        "lights": list(lights),
        "sampling": sampled(),
        **changes,
    }


def room() -> list[Json]:
    """Floor, ceiling, back and side walls that share corners and edges bit for bit."""
    return [
        rectangle([-2, 0, -2], [0, 0, 4], [4, 0, 0]),
        rectangle([-2, 4, -2], [4, 0, 0], [0, 0, 4]),
        rectangle([-2, 0, -2], [4, 0, 0], [0, 4, 0]),
        rectangle([-2, 0, -2], [0, 4, 0], [0, 0, 4]),
        rectangle([2, 0, -2], [0, 0, 4], [0, 4, 0]),
    ]


class Files(dict[str, bytes]):
    """Files in memory, as an asset source."""

    def read(self, name: str) -> bytes:
        return self[name]


def png(codes: NDArray[np.uint8]) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(codes).save(buffer, format="PNG")
    return buffer.getvalue()


def plan_of(
    document: Mapping[str, Any], quality: FixedQuality | None = None, *, culling: bool = True, files: Any = ()
) -> renderer.RenderPlan:
    loaded = renderer.load_scene(dict(document), assets=Files(files))
    return renderer.compile_scene(loaded, quality, culling=culling)


def image_of(
    document: Mapping[str, Any], quality: FixedQuality | None = None, **options: Any
) -> NDArray[np.float32]:
    return renderer.render(plan_of(document, quality, **options)).image


def samples_of(plan: renderer.RenderPlan) -> NDArray[np.float64]:
    """Radiance of every camera sample (H, W, S, 3) before any rounding to float32."""
    count = plan.antialiasing.samples
    whole = Tile(0, 0, 0, plan.width, plan.height)
    result = np.full((plan.height, plan.width, count, 3), np.nan)
    all_samples = Pass(1, 1, 0, count)
    for block in blocks(whole, all_samples):
        rays = camera_rays(plan, block, all_samples)
        values = radiance(plan, rays, Counter())
        result[block.rows, block.columns] = values.reshape(3, -1, count).transpose(1, 2, 0)
    return result
