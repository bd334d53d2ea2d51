"""A student's whole program: reads the scenes of the assignment, and writes every file to hand in.

It shares no code with the package that grades it.
"""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image

from tests.service.grading.assignment.shapes import Array, Wrong, unit
from tests.service.grading.assignment.tracer import Json, Tracer, encoded

SAMPLES = 16

ADVANCED = "antialiasing_advanced"
"""The scene that needs better sample positions than random ones."""


def run(scenes: Path, out: Path, wrong: Wrong = frozenset(), samples: int = SAMPLES, seed: int = 0) -> None:
    """Write the files for all scenes of a folder."""
    out.mkdir(parents=True, exist_ok=True)
    for name in names(scenes):
        save(scenes, out, name, wrong, samples, seed)


def names(scenes: Path) -> Iterator[str]:
    """The scenes of a folder, without `.json`."""
    yield from sorted(file.stem for file in scenes.glob("*.json"))


def save(
    scenes: Path, out: Path, name: str, wrong: Wrong = frozenset(), samples: int = SAMPLES, seed: int = 0
) -> None:
    """Save the file for a scene: hits if rays are given for it, else a picture."""
    if scenes.joinpath(f"{name}.npz").exists():
        np.savez(out / f"{name}.npz", **hits(scenes, name, wrong))
    else:
        Image.fromarray(picture(scenes, name, wrong, samples, seed)).save(out / f"{name}.png")


def read(scenes: Path, name: str) -> Json:
    loaded: Json = json.loads(scenes.joinpath(f"{name}.json").read_text())
    return loaded


def picture(scenes: Path, name: str, wrong: Wrong, samples: int = SAMPLES, seed: int = 0) -> Array:
    """8-bit codes, (H, W, 3)."""
    pattern = "random"
    if name == ADVANCED and "plain_random" not in wrong:
        pattern = "grid" if "upright_grid" in wrong else "jittered"
    tracer = Tracer(read(scenes, name), scenes, wrong, seed)
    return encoded(tracer.picture(samples, pattern), wrong)


def hits(scenes: Path, name: str, wrong: Wrong) -> dict[str, Array]:
    """The arrays of the ray table: t, position, normal and shape of every given ray."""
    with np.load(scenes / f"{name}.npz") as rays:
        origins, directions = rays["origins"], rays["directions"]
    if "directions_normalised" in wrong:
        directions = unit(directions)
    tracer = Tracer(read(scenes, name), scenes, wrong)
    t, shape = tracer.hits(origins, directions)
    places = origins + np.where(shape < 0, 0, t)[:, None] * directions
    normals = tracer.normals(shape, places, directions)
    return {"t": t, "position": places, "normal": normals, "shape": tracer.numbers[shape]}


def normal_codes(scenes: Path, name: str, wrong: Wrong, samples: int = SAMPLES, seed: int = 0) -> Array:
    """Normals as 8-bit codes of (n + 1) / 2; black for misses."""
    normals = Tracer(read(scenes, name), scenes, wrong, seed).normal_picture(samples)
    return np.round(255 * normals).astype(np.uint8)
