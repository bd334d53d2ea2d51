"""Converged pictures by Mitsuba, kept in tests/pictures/references, and how far a picture is from them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from accuracy.statistics import rms_difference
from benchmarks.report import SCENES

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

FOLDER = SCENES.parent / "tests" / "pictures" / "references"
FOLDERS = {"mesh": "gallery", "normal_texturing": "gallery"}
NAMES = ("soft", "chess", "mesh", "normal_texturing", "lamp", "shell", "textured_room", "lens_room")
PATHS = {name: SCENES / FOLDERS.get(name, "study") / f"{name}.json" for name in NAMES}
"""The scene file that each reference shows."""


def load(name: str) -> tuple[NDArray[np.float64], float]:
    """A reference, linear, (H, W, 3), and its own RMSE x 255: in the file red is above green above blue."""
    with Image.open(FOLDER / f"{name}.png") as file:
        levels = np.asarray(file, dtype=np.float64)
    provenance = json.loads((FOLDER / f"{name}.json").read_text())
    return np.stack(np.split(levels, 3), axis=2) / 65535, float(provenance["own_error_255"])


def rmse_255(image: ArrayLike, reference: ArrayLike) -> float:
    """Root mean square difference of linear values clipped to 0..1, in units of 1/255."""
    return 255 * rms_difference(image, reference)
