"""Parts of scenes as a user writes them, and the short way from a scene to its pixels."""

import io
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import renderer
from renderer.integrator import camera_rays, radiance
from renderer.tiling import blocks
from schemas.quality import FixedQuality, Quality
from schemas.tiles import Pass, Tile

SINGLE = FixedQuality(mode="fixed", precision="single")
DOUBLE = FixedQuality(mode="fixed", precision="double")


class Files(dict[str, bytes]):
    """Files that exist in memory only."""

    def read(self, name: str) -> bytes:
        return self[name]


def png(codes: NDArray[Any]) -> bytes:
    """A picture file of codes (H, W, 3) uint8, or of heights (H, W) uint16."""
    buffer = io.BytesIO()
    Image.fromarray(codes).save(buffer, format="PNG")
    return buffer.getvalue()


def same(a: NDArray[Any], b: NDArray[Any]) -> bool:
    return a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes()


def plan_of(
    document: Mapping[str, Any], quality: Quality | None = None, *, culling: bool = True, files: Any = ()
) -> renderer.RenderPlan:
    loaded = renderer.load_scene(dict(document), assets=Files(files))
    return renderer.compile_scene(loaded, quality, culling=culling)


def image_of(
    document: Mapping[str, Any], quality: Quality | None = None, **options: Any
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


def few_of(count: int, few: int) -> list[Any]:
    """Seeds of a sweep, of which the slow tier takes all but the first few."""
    return [seed if seed < few else pytest.param(seed, marks=pytest.mark.slow) for seed in range(count)]
