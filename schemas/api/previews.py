"""Previews: a small picture of a scene, at once and without a job."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from schemas.base import Closed
from schemas.quality import Antialiasing, FixedQuality, LightSampling
from schemas.quantities import WHOLE
from schemas.scene import Scene

PREVIEW_QUALITY = FixedQuality(
    mode="fixed",
    antialiasing=Antialiasing(pattern="uniform", samples=4),
    light=LightSampling(pattern="sobol", samples=4),
)
"""Smooth edges and recognizable penumbrae at the least cost."""


class PreviewRequest(Closed):
    """The body of ``POST /v1/previews``."""

    scene: Scene = Field(description="The scene to render.")
    side: Annotated[int, Field(strict=True, ge=8, le=512), WHOLE] = Field(
        default=128, description="Most pixels along a side; a smaller picture keeps its size."
    )

    @property
    def small_scene(self) -> Scene:
        """The scene with fewer pixels, in the proportions of its own as far as whole numbers allow."""
        camera = self.scene.camera
        factor = min(1.0, self.side / max(camera.width, camera.height))
        width, height = (max(1, round(factor * length)) for length in (camera.width, camera.height))
        return self.scene.model_copy(update={"camera": camera.resized(width, height)})
