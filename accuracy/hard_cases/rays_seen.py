"""What rays of one's own see: the renderer's stages, asked without a picture."""

import io
from collections import Counter

import numpy as np
from PIL import Image

import renderer
from accuracy.hard_cases.documents import Json
from renderer.integrator import intersect, local_radiance
from renderer.interaction import Points, Rays
from renderer.math.arrays import Floats
from schemas.quality import FixedQuality

DOUBLE = FixedQuality(mode="fixed", precision="double")
SINGLE = FixedQuality(mode="fixed", precision="single")


class Files(dict[str, bytes]):
    """Files that exist in memory only."""

    def read(self, name: str) -> bytes:
        """The content of a file."""
        return self[name]


def png(codes: np.ndarray) -> bytes:
    """A picture file of codes (H, W, 3) uint8, or of heights (H, W) uint16."""
    buffer = io.BytesIO()
    Image.fromarray(codes).save(buffer, format="PNG")
    return buffer.getvalue()


def plan_of(
    document: Json, quality: FixedQuality = DOUBLE, files: dict[str, bytes] | None = None
) -> renderer.RenderPlan:
    """The plan of a scene with files in memory."""
    return renderer.compile_scene(renderer.load_scene(document, assets=Files(files or {})), quality)


def radiance(plan: renderer.RenderPlan, origins: Floats, directions: Floats) -> Floats:
    """Radiance (3, N) along rays (3, N), without what comes by further rays."""
    return local_radiance(plan, _rays(origins, directions), Counter())[0]


def points(plan: renderer.RenderPlan, origins: Floats, directions: Floats) -> Points:
    """The points that rays (3, N) meet, ready for light."""
    return intersect(plan, _rays(origins, directions), lights=False)


def _rays(origins: Floats, directions: Floats) -> Rays:
    numbers = np.arange(directions.shape[1])
    return Rays(origins, directions, numbers, np.zeros_like(numbers))
