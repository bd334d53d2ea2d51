"""How often honest pictures look as if one was made from another, and how often altered copies are found.

``python -m tools.docs.measure_likeness`` renders pictures of the ready assignment with a simple ray tracer
that shares no code with this one, 200 seeds of the right program and 200 of each of two wrong ones, which
takes some minutes on one core. It saves the counts in docs/figures/class.json.
"""

from __future__ import annotations

import io
import json
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image, ImageFilter

from accuracy.comparison import Picture, picture_of
from accuracy.study.journal import describe
from service.grading.likeness.fingerprints import Fingerprint, agreement, fingerprint, noise_of, pairs
from tests.service.grading.assignment.program import read
from tests.service.grading.assignment.tracer import Tracer, encoded
from tools.docs.figures import FOLDER
from tools.docs.generate_assignment_page import ASSIGNMENT

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.service.grading.assignment.shapes import Array

FIGURES = FOLDER / "class.json"

SCENES = ("phong_highlights", "shadow_soft")
"""Noise at edges, and in soft shadows too."""

PROGRAMS = {
    "right": "right",
    "half_pixel_off": "samples lie around the pixel's corner",
    "normal_like_points": "ellipsoids have the normals of spheres",
}
"""Mistakes of the ray tracer, and what they are."""

SEEDS, SAMPLES = 200, 16

SMALLER = 2
"""Pictures have this share of the width and height: fewer places make chance correlations larger."""

MINORITY = 20
"""Seeds of a wrong program among all of the right one: those of a class that make the same mistake."""

COPIED = 20
"""Pictures that are copied, each in all ways."""


def main() -> None:
    """Render, count, print and save."""
    scenes = [measured(name) for name in SCENES]
    found = {
        "machine": {name: value for name, value in describe().items() if name != "load"},
        "seeds": SEEDS,
        "samples": SAMPLES,
        "minority": MINORITY,
        "size": [small(SCENES[0])["camera"][side] for side in ("width", "height")],
        "honest": [total(program, scenes) for program in PROGRAMS],
        "altered": [
            {
                "how": how,
                "copies": COPIED * len(SCENES),
                "found": sum(each["altered"][how] for each in scenes),
            }
            for how in ALTERATIONS
        ],
        "scenes": scenes,
    }
    print(json.dumps(found, indent=1))
    save("noise", found)


def save(part: str, found: dict[str, Any]) -> None:
    """Keep the figures of one part beside those of others."""
    kept = json.loads(FIGURES.read_text(encoding="utf-8")) if FIGURES.exists() else {}
    FIGURES.write_text(json.dumps(kept | {part: found}, indent=1) + "\n", encoding="utf-8")


def total(program: str, scenes: list[dict[str, Any]]) -> dict[str, Any]:
    """The pairs of a program over all scenes."""
    parts = [each["honest"][program] for each in scenes]
    return {
        "program": PROGRAMS[program],
        "pairs": sum(part["compared"] for part in parts),
        "alarms": sum(part["alarms"] for part in parts),
        "highest": max(part["highest"] for part in parts),
        "closest": min(part["closest"] for part in parts),
    }


def measured(name: str) -> dict[str, Any]:
    """All counts of a scene."""
    wanted = reference(name)
    rendered = {program: [picture(name, program, seed) for seed in range(SEEDS)] for program in PROGRAMS}
    prints = {
        program: [fingerprint(seen(image), wanted) for image in images]
        for program, images in rendered.items()
    }
    right = prints["right"]
    honest = {"right": counted(right, 0)}
    for program in [*PROGRAMS][1:]:
        groups = [prints[program][start : start + MINORITY] for start in range(0, SEEDS, MINORITY)]
        honest[program] = summed([counted(group + right, len(group)) for group in groups])
    altered = {
        how: copies_found(right, rendered["right"], alter, wanted) for how, alter in ALTERATIONS.items()
    }
    return {"scene": name, "honest": honest, "altered": altered}


def counted(prints: list[Fingerprint], wrong: int) -> dict[str, Any]:
    """Pairs of a class, those of its first pictures if some of them are wrong, and alarms among them."""
    noise = noise_of(prints)
    assert noise is not None
    found = agreement(noise.values, noise.counted, noise.values, noise.counted)
    rows = wrong or len(prints)
    among = np.triu(np.ones(found.places.shape, bool), 1)[:rows]
    compared = among & (found.places[:rows] > 0)
    return {
        "pairs": int(among.sum()),
        "compared": int(compared.sum()),
        "alarms": sum(pair.first < rows for pair in pairs(noise)),
        "highest": round(float(found.correlation[:rows][compared].max(initial=-1.0)), 3),
        "closest": round(float(found.difference[:rows][compared].min(initial=np.inf)), 3),
        "places": int(noise.places.size),
    }


def summed(parts: list[dict[str, Any]]) -> dict[str, Any]:
    """The sums of counts; of the correlations the highest, of differences and places the lowest."""
    merge: dict[str, Callable[..., Any]] = {"highest": max, "closest": min, "places": min}
    return {name: merge.get(name, sum)(part[name] for part in parts) for name in parts[0]}


def copies_found(
    prints: list[Fingerprint], originals: list[Array], alter: Callable[[Array], Array], wanted: Picture
) -> int:
    """How many altered copies are found in a class of originals."""
    copies = [fingerprint(seen(alter(image)), wanted) for image in originals[:COPIED]]
    noise = noise_of([*prints, *copies])
    assert noise is not None
    found = {(pair.first, pair.second) for pair in pairs(noise)}
    return sum((place, len(prints) + place) in found for place in range(COPIED))


def small(name: str) -> dict[str, Any]:
    """A scene with smaller pictures."""
    scene = read(ASSIGNMENT, name)
    camera = scene["camera"]
    size = {side: camera[side] // SMALLER for side in ("width", "height")}
    return scene | {"camera": camera | size}


def picture(name: str, program: str, seed: int) -> Array:
    """The codes that a program makes of a scene, (H, W, 3) uint8."""
    wrong = frozenset() if program == "right" else frozenset([program])
    tracer = Tracer(small(name), ASSIGNMENT, wrong, seed + SEEDS * [*PROGRAMS].index(program))
    return encoded(tracer.picture(SAMPLES), wrong)


def seen(codes: Array) -> Picture:
    """A picture as it is read from a PNG file."""
    file = io.BytesIO()
    Image.fromarray(codes).save(file, "PNG")
    return picture_of(file.getvalue(), "picture.png", "srgb")


def reference(name: str) -> Picture:
    """The reference with smaller pixels."""
    with np.load(ASSIGNMENT / "references" / f"{name}.npz") as kept:
        values = kept["image"].astype(np.float64)
    height, width = values.shape[0] // SMALLER, values.shape[1] // SMALLER
    means = values.reshape(height, SMALLER, width, SMALLER, 3).mean(axis=(1, 3)).astype(np.float32)
    file = io.BytesIO()
    np.save(file, means)
    return picture_of(file.getvalue(), "reference.npy", "linear")


def brighter(codes: Array, factor: float) -> Array:
    """All codes times a factor."""
    return np.clip(np.round(codes * factor), 0, 255).astype(np.uint8)


def noisier(codes: Array, deviation: float) -> Array:
    """Codes with independent normal noise on top."""
    more = np.random.default_rng(1).normal(0, deviation, codes.shape)
    return np.clip(np.round(codes + more), 0, 255).astype(np.uint8)


def compressed(codes: Array, quality: int) -> Array:
    """What is left after lossy compression."""
    file = io.BytesIO()
    Image.fromarray(codes).save(file, "JPEG", quality=quality)
    return np.asarray(Image.open(file))


def blurred(codes: Array, radius: float) -> Array:
    """A Gaussian blur."""
    return np.asarray(Image.fromarray(codes).filter(ImageFilter.GaussianBlur(radius)))


ALTERATIONS: dict[str, Callable[[Array], Array]] = {
    "saved again": partial(brighter, factor=1.0),
    "3 % brighter": partial(brighter, factor=1.03),
    "noise of 2 codes added": partial(noisier, deviation=2.0),
    "noise of 5 codes added": partial(noisier, deviation=5.0),
    "JPEG of quality 90": partial(compressed, quality=90),
    "JPEG of quality 75": partial(compressed, quality=75),
    "blurred by half a pixel": partial(blurred, radius=0.5),
}


if __name__ == "__main__":
    main()
