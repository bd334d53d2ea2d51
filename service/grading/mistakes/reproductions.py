"""Pictures of mistakes: the reference's scene, rendered with one mistake, at a cost that is counted."""

from __future__ import annotations

import hashlib
import io
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import renderer
from renderer.math.arrays import Floats
from renderer.plan.building import build_plan
from renderer.plan.geometry import SceneGeometry, build_geometry
from renderer.plan.request import Request
from renderer.scenes import LoadedScene
from schemas.quality import Antialiasing, FixedQuality, LightSampling
from service.grading.folders import keep
from service.grading.mistakes.altered_scenes import Alteration

BUILT = ("shapes", "materials", "textures")
"""Fields of a scene from which its geometry is built; scenes that share them share it."""


@dataclass(frozen=True, slots=True)
class Detail:
    """Resolution at which a mistake is rendered.

    Attributes
    ----------
    most_pixels : int
        Larger pictures are reduced: a mistake shows at any size.
    samples, light_points : int
        Of each pixel, and of each light from each sample. Both lie on a grid: noise would hide the mistake.
    """

    most_pixels: int
    samples: int
    light_points: int


BUDGET = 100_000_000
"""Camera and shadow rays after which no further mistake is tried: a picture of 128 x 96 pixels with two
lights takes half of them."""

GLANCE, CLOSE = Detail(4_000, 4, 4), Detail(20_000, 16, 16)
"""Of the first trial, and of the second one for the mistakes that remain likely."""


@dataclass(slots=True)
class Reproductions:
    """Renders a scene with mistakes.

    Attributes
    ----------
    scene : LoadedScene
        As it should be.
    keep : Path or None
        Where altered pictures are kept for other submissions.
    rays : int
        Camera and shadow rays that are left. They are counted, never seconds: a diagnosis must not depend on
        how busy the machine is.
    """

    scene: LoadedScene
    keep: Path | None = None
    rays: int = BUDGET
    _geometry: SceneGeometry | None = field(default=None, init=False)

    @property
    def right(self) -> Alteration:
        """No mistake."""
        return Alteration("", self.scene)

    def factor(self, detail: Detail) -> int:
        """Pixels of the scene's camera along each side of a pixel of a trial."""
        camera = self.scene.document.camera
        return reduction(camera.width, camera.height, detail.most_pixels)

    def afford(self, detail: Detail) -> bool:
        """Whether the rays of a trial are left; they are then paid."""
        camera, factor = self.scene.document.camera, self.factor(detail)
        pixels = camera.width * camera.height // factor**2
        cost = pixels * detail.samples * (1 + detail.light_points * len(self.scene.document.lights))
        is_left = cost <= self.rays
        self.rays -= cost if is_left else 0
        return is_left

    def draw(self, alteration: Alteration, detail: Detail) -> Floats | None:
        """The picture of a mistake, linear, clipped to 0..1, (H, W, 3) with the size of trials.

        None if too few rays are left for it.
        """
        if not self.afford(detail):
            return None
        scene = self.reduced(alteration.scene, detail)
        key = f"{alteration.place} {detail} {scene.document.model_dump_json()}"
        picture = kept(self.keep, key, partial(self._rendered, alteration, scene, detail))
        return np.clip(picture.astype(np.float64), 0, 1)

    def _rendered(self, alteration: Alteration, scene: LoadedScene, detail: Detail) -> NDArray[np.float32]:
        geometry = self._built(alteration.scene)
        pixels = Antialiasing(pattern="uniform", samples=detail.samples)
        quality = quality_of(scene, pixels, LightSampling(pattern="uniform", samples=detail.light_points))
        plan = build_plan(Request(scene, quality, geometry, culling=True))
        return renderer.render(plan if alteration.change is None else alteration.change(plan)).image

    def reduced(self, scene: LoadedScene, detail: Detail) -> LoadedScene:
        """A scene at the size of trials."""
        camera, factor = scene.document.camera, self.factor(detail)
        size = {"width": camera.width // factor, "height": camera.height // factor}
        document = scene.document.model_copy(update={"camera": camera.model_copy(update=size)})
        return LoadedScene(document, scene.assets)

    def _built(self, scene: LoadedScene) -> SceneGeometry:
        """The geometry of a scene, built once for all that have the same shapes and materials."""
        right = self.scene
        if scene.assets is not right.assets or any(
            getattr(scene.document, name) is not getattr(right.document, name) for name in BUILT
        ):
            return build_geometry(scene)
        if self._geometry is None:
            self._geometry = build_geometry(right)
        return self._geometry


def reduction(width: int, height: int, most_pixels: int) -> int:
    """The smallest common divisor of both sides that leaves few enough pixels, or the largest one.

    Examples
    --------
    >>> reduction(128, 96, 20_000), reduction(128, 96, 4_000), reduction(127, 96, 4_000)
    (1, 2, 1)
    """
    common = math.gcd(width, height)
    factors = [factor for factor in range(1, common + 1) if common % factor == 0]
    few = (factor for factor in factors if width * height <= most_pixels * factor**2)
    return next(few, factors[-1])


def reduced(values: Floats, factor: int) -> Floats:
    """Means of factor x factor pixels, (H, W, 3) -> (H / factor, W / factor, 3)."""
    height, width = values.shape[0] // factor, values.shape[1] // factor
    means: Floats = values.reshape(height, factor, width, factor, 3).mean(axis=(1, 3))
    return means


def quality_of(scene: LoadedScene, pixels: Antialiasing, lights: LightSampling) -> FixedQuality:
    """Samples of each pixel and light; a single light sample is kept: the hard shadows are intended."""
    own = scene.document.sampling.light
    single = (own.pattern, own.samples) == ("uniform", 1)
    return FixedQuality(mode="fixed", antialiasing=pixels, light=own if single else lights)


def kept(folder: Path | None, key: str, render: Callable[[], NDArray[np.float32]]) -> NDArray[np.float32]:
    """A picture from a folder; if it is not there yet, it is rendered and put there.

    Parameters
    ----------
    folder
        None if no other submission follows: then nothing is kept.
    key
        All that the picture depends on. Of files that a scene names, only the names need to be in it: they
        must not change while the folder is used.
    render
        Makes the picture, (H, W, 3).
    """
    if folder is None:
        return render()
    file = folder / f"{hashlib.sha256(key.encode()).hexdigest()}.npy"
    if file.exists():
        picture: NDArray[np.float32] = np.load(file, allow_pickle=False)
        return picture
    picture = render()
    content = io.BytesIO()
    np.save(content, picture)
    keep(file, content.getvalue())
    return picture
