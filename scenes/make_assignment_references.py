"""Render the references of the ready assignment and estimate their error.

Run it with ``python -m scenes.make_assignment_references`` after the scripts that make scenes and rays. Names
of scenes as arguments render only those.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import renderer
from renderer.images import files as image_files
from scenes.make_assignment import PICTURES
from scenes.make_assignment_parts import FOLDER
from scenes.make_assignment_rays import SHOWN_NORMALS

Array = NDArray[np.float64]

TEXTURES = renderer.load_scene(FOLDER / "texture.json").assets
DISPLAY = renderer.load_scene(FOLDER / "texture.json").document.display

SAMPLES, LIGHT_POINTS = 1024, 4
"""Samples of each half of a reference; both halves take 8,192 light samples per pixel."""

SEEDS = (1, 2)
"""Seeds of the halves: half the RMSE between them estimates the error of their mean."""

SINGLE = 1024
"""Random samples of a pixel from which the variance of one is measured, to about 10 %."""

GRID = 16
"""Rays along each side of a pixel in pictures of normals."""


def main() -> None:
    """Write the references named on the command line, or all, and their errors."""
    place = FOLDER / "references"
    place.mkdir(exist_ok=True)
    asked = sys.argv[1:] or [*PICTURES, *SHOWN_NORMALS]
    kept = place / "errors.json"
    errors = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
    for name in filter(PICTURES.__contains__, asked):
        halves = [half(name, seed) for seed in SEEDS]
        image = np.mean(halves, axis=0)
        errors[name] = round(rms(halves[0] - halves[1]) / 2, 6)
        save(place, name, image, variances(name))
        image_files.write_image(place / f"{name}.png", image, DISPLAY)
        print(f"{name}: error {errors[name]:.6f}")
    for name in filter(SHOWN_NORMALS.__contains__, asked):
        image, single = normals(name)
        save(place, f"{name}_normals", image, single)
        # Encoded like a submission: numbers, not sRGB.
        Image.fromarray(np.round(255 * image).astype(np.uint8)).save(place / f"{name}_normals.png")
    kept.write_text(json.dumps(errors, indent=2) + "\n", encoding="utf-8")


def half(name: str, seed: int) -> Array:
    """One of two independent pictures of a scene, (H, W, 3) linear, clipped to 0..1."""
    document = json.loads(FOLDER.joinpath(f"{name}.json").read_text())
    document["sampling"] = {
        "antialiasing": {"pattern": "sobol", "samples": SAMPLES},
        "light": {"pattern": "sobol", "samples": LIGHT_POINTS},
        "seed": seed,
    }
    return rendered(document)


def rendered(document: dict[str, Any]) -> Array:
    """Render a scene of the assignment, linear, clipped to 0..1."""
    return np.clip(renderer.render(compiled(document)).image.astype(np.float64), 0, 1)


def compiled(document: dict[str, Any], layers: tuple[str, ...] = ()) -> Any:
    """The plan of a scene of the assignment."""
    return renderer.compile_scene(renderer.load_scene(document, assets=TEXTURES), layers=layers)


def variances(name: str) -> Array:
    """Variance of one random camera sample with one random point of the light, (H, W, 3) linear."""
    document = json.loads(FOLDER.joinpath(f"{name}.json").read_text())
    document["sampling"] = {
        "antialiasing": {"pattern": "random", "samples": SINGLE},
        "light": {"pattern": "random", "samples": 1},
        "seed": len(SEEDS) + 1,
    }
    made = renderer.render(compiled(document, ("error",))).layers["error"].astype(np.float64)
    return SINGLE * made * made


def rms(difference: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(difference * difference)))


def normals(name: str) -> tuple[Array, Array]:
    """Pixel means of normals n facing the viewer as (n + 1) / 2, black for misses, and their variances."""
    plan = renderer.compile_scene(renderer.load_scene(FOLDER / f"{name}.json"))
    camera = plan.camera
    rows, columns = camera.height, camera.width
    places = (np.arange(GRID) + 0.5) / GRID
    total, squares = np.zeros((2, rows * columns, 3))
    for a in places:
        for b in places:
            y, x = np.mgrid[:rows, :columns].reshape(2, -1) + np.array([[b], [a]])
            hits = renderer.trace(plan, *through(plan.document.camera, x, y))
            shown = np.where((hits.shape >= 0)[:, None], (hits.normal + 1) / 2, 0)
            total += shown
            squares += shown * shown
    means = total / GRID**2
    single = np.maximum(squares / GRID**2 - means * means, 0)
    return means.reshape(rows, columns, 3), single.reshape(rows, columns, 3)


def through(camera: Any, x: Array, y: Array) -> tuple[Array, Array]:
    """Origins and directions, (N, 3), of camera rays through points (N,) in pixels from the upper left."""
    position = np.array(camera.position)
    forward = np.array(camera.look_at) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    half_height = np.tan(np.radians(camera.vertical_fov) / 2)
    across = half_height * camera.width / camera.height * (2 * x / camera.width - 1)
    up = half_height * (1 - 2 * y / camera.height)
    directions = forward + np.outer(across, right) + np.outer(up, np.cross(right, forward))
    return np.broadcast_to(position, directions.shape), directions


def save(place: Any, name: str, image: Array, single: Array) -> None:
    """Save a picture with its noise: the error that as many random samples leave, and their number.

    The samples of the pictures are not random, so that their own error is far smaller.
    """
    samples = np.full(image.shape[:2], len(SEEDS) * SAMPLES, np.uint16)
    np.savez_compressed(
        place / f"{name}.npz",
        image=image.astype(np.float16),
        error=np.sqrt(single / samples[:, :, None]).astype(np.float16),
        samples=samples,
    )


if __name__ == "__main__":
    main()
