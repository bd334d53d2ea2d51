"""Converged pictures of the study scenes, made by another renderer and kept in the repository."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from accuracy.statistics import clipped, rms_difference

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from schemas.scene import Scene

FOLDER = Path(__file__).parent.parent / "tests" / "images" / "references"
SCENES = Path(__file__).parent.parent / "scenes" / "study"
PATHS = {
    "soft": SCENES / "soft.json",
    "chess": SCENES / "chess.json",
    "mesh": SCENES.parent / "gallery" / "mesh.json",
    "normal_texturing": SCENES.parent / "gallery" / "normal_texturing.json",
    "lamp": SCENES / "lamp.json",
    "shell": SCENES / "shell.json",
    "textured_room": SCENES / "textured_room.json",
    "lens_room": SCENES / "lens_room.json",
}
"""The scene file that each reference shows."""
NAMES = tuple(PATHS)

_LARGEST = 65535


@dataclass(frozen=True)
class Provenance:
    """How a reference was made.

    Attributes
    ----------
    renderer : str
        Name, version and variant of the renderer.
    command : str
        What makes the picture again.
    date : str
        Day on which it was made, ISO 8601.
    samples_per_pixel : int
        Camera samples of each pixel, each with one light sample.
    own_error_255 : float
        Estimated RMSE of the reference itself, in units of 1/255, from two halves with different seeds.
    scene_sha256 : str
        `scene_digest` of the scene that it shows.
    """

    renderer: str
    command: str
    date: str
    samples_per_pixel: int
    own_error_255: float
    scene_sha256: str


def scene_digest(scene: Scene) -> str:
    """Name what a converged picture depends on: all that the scene says, but its name and its sampling."""
    content = scene.model_dump_json(exclude={"name", "sampling"}, exclude_unset=True)
    return hashlib.sha256(content.encode()).hexdigest()


def rmse_255(image: ArrayLike, reference: ArrayLike) -> float:
    """Root mean square difference of linear values clipped to 0..1, in units of 1/255.

    Examples
    --------
    >>> round(rmse_255([0.0, 2.0], [1 / 255, 1.0]), 3)
    0.707
    """
    return 255 * rms_difference(image, reference)


def true_rmse_255(image: ArrayLike, reference: ArrayLike, own_error_255: float) -> float:
    """Root mean square error of a picture, without the reference's own part in it, in units of 1/255.

    Errors that know nothing of each other add in squares, and the reference's own is known from its halves.
    With halves m + d and m - d of mean m this is the mean of the product of the picture's differences from
    both: (x - m - d) (x - m + d) = (x - m)^2 - d^2. So it has no bias, and no half needs to be kept.

    Parameters
    ----------
    own_error_255 : float
        `Provenance.own_error_255`, the root mean square of d.

    Returns
    -------
    float
        0 where the picture is nearer to the reference than that.

    Examples
    --------
    >>> round(true_rmse_255([5 / 255, -1.0], [0.0, 0.0], 1.5), 3)
    3.202
    """
    square = rmse_255(image, reference) ** 2 - own_error_255**2
    return math.sqrt(max(square, 0.0))


def mean_difference_255(image: ArrayLike, reference: ArrayLike) -> float:
    """Mean of image - reference on linear values clipped to 0..1, in units of 1/255.

    Examples
    --------
    >>> round(mean_difference_255([0.5, 2.0], [0.5, 1 - 1 / 255]), 3)
    0.5
    """
    return float(255 * np.mean(clipped(image) - clipped(reference)))


def save(name: str, image: NDArray[np.float64], provenance: Provenance, folder: Path = FOLDER) -> None:
    """Write `name`.png and `name`.json.

    Parameters
    ----------
    image : (H, W, 3) array
        Linear values; what lies outside 0..1 is clipped.

    Notes
    -----
    The file is a 16-bit greyscale PNG, red above green above blue, because it compresses five times better
    than an array file and keeps 1/65535. Values are linear: it looks dark in a viewer.
    """
    folder.mkdir(parents=True, exist_ok=True)
    levels = np.floor(clipped(image) * _LARGEST + 0.5).astype(np.uint16)
    Image.fromarray(np.concatenate(list(np.moveaxis(levels, 2, 0)))).save(
        folder / f"{name}.png", optimize=True
    )
    (folder / f"{name}.json").write_text(json.dumps(asdict(provenance), indent=2) + "\n")


def load(name: str, folder: Path = FOLDER) -> tuple[NDArray[np.float64], Provenance]:
    """Read a reference: linear values in 0..1 of shape (H, W, 3), and how they were made."""
    with Image.open(folder / f"{name}.png") as file:
        levels = np.asarray(file, dtype=np.float64)
    image = np.stack(np.split(levels, 3), axis=2) / _LARGEST
    return image, read_provenance(name, folder)


def read_provenance(name: str, folder: Path = FOLDER) -> Provenance:
    """Read how a reference was made."""
    return Provenance(**json.loads((folder / f"{name}.json").read_text()))
