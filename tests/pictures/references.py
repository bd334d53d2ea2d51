"""Converged pictures of packaged scenes by another renderer, and errors against converged pictures."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

import scenes
from accuracy.statistics import clipped
from schemas.quality import FixedQuality
from schemas.scene import Scene

FOLDER = Path(__file__).parent / "references"
SCENES = Path(scenes.__file__).parent
PATHS = {
    name: SCENES / folder / f"{name}.json"
    for folder, names in {
        "study": ("soft", "chess", "lamp", "shell", "textured_room", "lens_room"),
        "gallery": ("mesh", "normal_texturing"),
    }.items()
    for name in names
}
"""The scene file that each stored picture shows."""

CONVERGED = FixedQuality.model_validate(
    {
        "mode": "fixed",
        "antialiasing": {"pattern": "sobol", "samples": 256},
        "light": {"pattern": "sobol", "samples": 4},
    }
)


@dataclass(frozen=True)
class Provenance:
    """Provenance of a stored picture: the mean of 8 by Mitsuba, and its own RMSE x 255."""

    renderer: str
    command: str
    date: str
    samples_per_pixel: int
    own_error_255: float
    scene_sha256: str


def load(name: str) -> tuple[NDArray[np.float64], Provenance]:
    """A stored picture, linear, (H, W, 3): in the file red is above green above blue, 16 bits each."""
    with Image.open(FOLDER / f"{name}.png") as file:
        levels = np.asarray(file, dtype=np.float64)
    provenance = Provenance(**json.loads((FOLDER / f"{name}.json").read_text()))
    return np.stack(np.split(levels, 3), axis=2) / 65535, provenance


def scene_digest(scene: Scene) -> str:
    """Hash of all that a converged picture depends on: the scene without name and sampling."""
    content = scene.model_dump(mode="json", exclude={"name", "sampling"}, exclude_unset=True)
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def difference_255(image: ArrayLike, reference: ArrayLike) -> NDArray[np.float64]:
    return 255 * (clipped(image) - clipped(reference))


def root_of_product(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Unbiased RMSE of a picture from its differences from two independent references."""
    return float(np.sqrt(max(float(np.mean(first * second)), 0.0)))
