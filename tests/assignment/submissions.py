"""Submissions to the ready assignment: a correct one, and wrong ones with one mistake each."""

import json
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
from PIL import Image

from scenes.make_assignment import PICTURES
from scenes.make_assignment_parts import FOLDER, Json
from scenes.make_assignment_rays import RAYS, SHOWN_NORMALS
from tests.assignment.shapes import Wrong, unit
from tests.assignment.tracer import Tracer, encoded

SAMPLES = 16

ADVANCED = "antialiasing_advanced"
"""The scene that needs better sample positions than random ones."""


def document(name: str) -> Json:
    loaded: Json = json.loads(FOLDER.joinpath(f"{name}.json").read_text())
    return loaded


def write(folder: Path, wrong: Wrong = frozenset(), samples: int = SAMPLES, seed: int = 0) -> None:
    """Write all files of a submission."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in (*PICTURES, *RAYS):
        save(folder, name, wrong, samples, seed)
    for name in SHOWN_NORMALS:
        codes = normal_codes(name, wrong, samples, seed)
        Image.fromarray(codes).save(folder / f"{name}_normals.png")


def save(folder: Path, name: str, wrong: Wrong = frozenset(), samples: int = SAMPLES, seed: int = 0) -> None:
    """Save the submitted file for a scene: a picture or hits."""
    if name in PICTURES:
        Image.fromarray(picture(name, wrong, samples, seed)).save(folder / f"{name}.png")
    else:
        np.savez(folder / f"{name}.npz", **hits(name, wrong))


def picture(name: str, wrong: Wrong, samples: int = SAMPLES, seed: int = 0) -> np.ndarray:
    pattern = "random"
    if name == ADVANCED and "plain_random" not in wrong:
        pattern = "grid" if "upright_grid" in wrong else "jittered"
    tracer = Tracer(document(name), FOLDER, wrong, seed)
    return encoded(tracer.picture(samples, pattern), wrong)


def hits(name: str, wrong: Wrong) -> dict[str, np.ndarray]:
    """The arrays that `penumbra trace` would write, from the simple tracer."""
    with np.load(FOLDER / f"{name}.npz") as rays:
        origins, directions = rays["origins"], rays["directions"]
    if "directions_normalised" in wrong:
        directions = unit(directions)
    tracer = Tracer(document(name), FOLDER, wrong)
    t, shape = tracer.hits(origins, directions)
    places = origins + np.where(shape < 0, 0, t)[:, None] * directions
    normals = tracer.normals(shape, places, directions)
    return {"t": t, "position": places, "normal": normals, "shape": tracer.numbers[shape]}


def normal_codes(name: str, wrong: Wrong, samples: int = SAMPLES, seed: int = 0) -> np.ndarray:
    """Normals as 8-bit codes of (n + 1) / 2; black for misses."""
    return np.round(255 * Tracer(document(name), FOLDER, wrong, seed).normal_picture(samples)).astype(
        np.uint8
    )


@cache
def right(samples: int = SAMPLES, seed: int = 0) -> Path:
    """A folder with the correct submission, made once per session."""
    folder = Path(mkdtemp(prefix="assignment-"))
    write(folder, samples=samples, seed=seed)
    return folder
