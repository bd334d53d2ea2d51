"""The grader on the ready assignment: a class of 200, honest pictures, attacks, and noise shared by chance.

It takes some twenty minutes on two idle cores. The submissions are made with this renderer, by its random
patterns and with other seeds than the references; mistakes are made in the scenes or in the pictures.
"""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image, ImageFilter

import renderer
from accuracy.comparison import picture_of
from benchmarks.report import SCENES, Json, keep, parser, show
from renderer.images.colors import srgb_from_linear
from renderer.scenes import LoadedScene
from schemas.grading.manifest_reading import read_manifest
from schemas.grading.manifests import ImageTest
from schemas.scene import Scene
from service.grading.folders import Folder
from service.grading.kinds import findings
from service.grading.likeness.fingerprints import fingerprint, noise_of, pairs
from service.grading.settings import Run

if TYPE_CHECKING:
    from collections.abc import Callable

    from service.grading.outcomes import Outcome

    Array = np.ndarray[Any, Any]
    Alter = Callable[[Array, np.random.Generator], Array]

ASSIGNMENT = SCENES / "assignment"
MANIFEST = read_manifest((ASSIGNMENT / "manifest.yaml").read_bytes(), yaml=True)
TESTS = {Path(test.submitted.file).stem: test for test in MANIFEST.tests if isinstance(test, ImageTest)}
ALIKE = "phong_highlights", "shadow_soft"
"""Tests whose pictures are compared within a class."""
STUDENTS, COPIES = 200, 5
"""Submissions of the class, and how many of them are copies of one run with other last bits."""


def _points(document: Json) -> Json:
    """Area lights as points at their centres."""

    def point(light: Json) -> Json:
        center = np.array(light["corner"]) + np.sum(light["edges"], axis=0) / 2
        return {"type": "point", "position": center.tolist(), "color": light["color"]}

    lights = [point(light) if light["type"] == "rectangle" else light for light in document["lights"]]
    return document | {"lights": lights}


def _shinier(document: Json) -> Json:
    shinier = {
        name: material | {"shininess": 2 * material.get("shininess", 1)}
        for name, material in document["materials"].items()
    }
    return document | {"materials": shinier}


def _wider(document: Json) -> Json:
    camera = document["camera"]
    return document | {"camera": camera | {"vertical_fov": min(2 * camera["vertical_fov"], 170)}}


WRONG_SCENES: dict[str, Callable[[Json], Json]] = {
    "no ambient term": lambda document: document | {"ambient": [0, 0, 0]},
    "hard shadows": _points,
    "twice the shininess": _shinier,
    "twice the field of view": _wider,
    "a shape is missing": lambda document: document | {"shapes": document["shapes"][:-1]},
    "no anti-aliasing": lambda document: (
        document | {"sampling": document["sampling"] | {"antialiasing": {"pattern": "center", "samples": 1}}}
    ),
}
WRONG_PICTURES: dict[str, Callable[[Array], Array]] = {
    "upside down": lambda linear: linear[::-1],
    "blue and red swapped": lambda linear: linear[:, :, ::-1],
    "a tenth too bright": lambda linear: 1.1 * linear,
    "one pixel off": lambda linear: np.roll(linear, 1, 1),
    "encoded twice": lambda linear: srgb_from_linear(np.clip(linear, 0, 1)),
}
WRONG = (*WRONG_SCENES, *WRONG_PICTURES)


def _gaussian(deviation: float) -> Alter:
    return lambda codes, random: codes + deviation * random.normal(size=codes.shape)


NOISE: dict[str, Alter] = {
    **{f"Gaussian {deviation}": _gaussian(deviation) for deviation in (5, 12, 25, 50)},
    "uniform 25": lambda codes, random: codes + random.uniform(-43, 43, codes.shape),
    "multiplied by 1 +- 0.3": lambda codes, random: codes * (1 + 0.3 * random.normal(size=codes.shape)),
    "salt": lambda codes, random: np.where(random.random(codes.shape[:2])[:, :, None] < 0.1, 255, codes),
    "blurred": lambda codes, _: np.asarray(Image.fromarray(codes).filter(ImageFilter.GaussianBlur(1))),
}
"""Attacks that hide the mistake of a wrong picture."""


def picture(name: str, wrong: str = "", samples: int = 16, seed: int = 0) -> Array:
    """A picture as a program makes it, 8-bit codes (H, W, 3)."""
    scene = renderer.load_scene(ASSIGNMENT / f"{name}.json")
    document = scene.document.model_dump(mode="json", exclude_unset=True)
    pattern = "stratified" if name == "antialiasing_advanced" else "random"
    document["sampling"] = {
        "antialiasing": {"pattern": pattern, "samples": samples},
        "light": {"pattern": "random", "samples": 1},
        "seed": seed + 1000,
    }
    if wrong in WRONG_SCENES:
        document = WRONG_SCENES[wrong](document)
    plan = renderer.compile_scene(LoadedScene(Scene.model_validate(document), scene.assets))
    linear = renderer.render(plan).image.astype(np.float64)
    if wrong in WRONG_PICTURES:
        linear = WRONG_PICTURES[wrong](linear)
    return _codes(255 * srgb_from_linear(np.clip(linear, 0, 1)))


def _codes(levels: Array) -> Array:
    return np.clip(np.rint(levels), 0, 255).astype(np.uint8)


def submit(folder: Path, number: int, wrong: str) -> None:
    """Write the whole submission of one run."""
    place = folder / f"student {number}.0"
    place.mkdir(parents=True)
    for name in TESTS:
        Image.fromarray(picture(name, wrong, seed=number)).save(place / f"{name}.png")
    for rays in ASSIGNMENT.glob("rays_*.npz"):
        with np.load(rays) as given:
            plan = renderer.compile_scene(rays.with_suffix(".json"))
            hits = renderer.trace(plan, given["origins"], given["directions"])
        np.savez(place / rays.name, t=hits.t, position=hits.position, normal=hits.normal, shape=hits.shape)


def copied(source: Path, target: Path, seed: int) -> None:
    """Copy a submission; a tenth of the codes of its pictures are larger by one."""
    shutil.copytree(source, target)
    random = np.random.default_rng(seed)
    for file in target.glob("*.png"):
        codes = np.asarray(Image.open(file))
        more = (codes < 255) & (random.random(codes.shape) < 0.1)
        Image.fromarray(codes + more.astype(np.uint8)).save(file)


def seconds_of_class(students: int) -> float:
    """Wall seconds of grading a class in a process of its own."""
    with tempfile.TemporaryDirectory() as place, ProcessPoolExecutor() as pool:
        folder = Path(place, "class")
        runs = -(-students // COPIES)
        made = [("", *WRONG)[number % (1 + len(WRONG))] for number in range(runs)]
        list(pool.map(partial(submit, folder), range(runs), made))
        for student in range(students):
            number, copy = divmod(student, COPIES)
            if copy:
                copied(folder / f"student {number}.0", folder / f"student {number}.{copy}", student)
        command = [sys.executable, "-m", "service.cli.main", "grade", str(ASSIGNMENT / "manifest.yaml")]
        command += ["--class", str(folder), "-o", str(Path(place, "marks"))]
        begun = time.perf_counter()
        subprocess.run(command, cwd=SCENES.parent, check=True, stdout=subprocess.DEVNULL)
        return time.perf_counter() - begun


def graded(name: str, codes: Array) -> Outcome:
    """Points of a picture before its mistakes are reproduced with the scene."""
    with tempfile.TemporaryDirectory() as place:
        Image.fromarray(codes).save(Path(place, f"{name}.png"), compress_level=1)
        folders = Folder(ASSIGNMENT.resolve(), "reference"), Folder(Path(place).resolve(), "submission")
        return next(iter(findings(TESTS[name], Run(MANIFEST, *folders))))


def honest(seeds: int, name: str) -> Counter[str]:
    """Count right pictures, and how many lose points or raise a signal."""
    found: Counter[str] = Counter()
    for samples, seed in product((4, 16, 64), range(seeds)):
        outcome = graded(name, picture(name, samples=samples, seed=seed))
        found.update(pictures=1, lost=outcome.share < 1, signals=bool(outcome.signals))
    return found


def attacks(name: str) -> Counter[str]:
    """Count wrong pictures with noise or a blur, and those that earn more than without it."""
    random, found = np.random.default_rng(1), Counter[str]()
    for wrong in WRONG:
        codes = picture(name, wrong)
        plain = graded(name, codes).share
        for alter in NOISE.values():
            share = graded(name, _codes(alter(codes, random))).share
            found.update(pictures=1, more=share > plain)
    return found


def likeness(seeds: int, name: str) -> Counter[str]:
    """Count pairs of honest pictures of a class, and those that seem to share their noise."""
    with np.load(ASSIGNMENT / "references" / f"{name}.npz") as kept:
        file = io.BytesIO()
        np.save(file, kept["image"].astype(np.float32))
    reference = picture_of(file.getvalue(), "reference.npy", "linear")
    prints = []
    for seed in range(seeds):
        file = io.BytesIO()
        Image.fromarray(picture(name, seed=seed)).save(file, "PNG")
        prints.append(fingerprint(picture_of(file.getvalue(), "picture.png", "srgb"), reference))
    noise = noise_of(prints)
    alarms = 0 if noise is None else len(list(pairs(noise)))
    return Counter(pairs=seeds * (seeds - 1) // 2, copies=alarms)


def main() -> None:
    """Print and keep the numbers of each test, and the seconds of the class."""
    options = parser("grading", __doc__)
    options.add_argument("--quick", action="store_true", help="try a twentieth")
    quick = options.parse_args().quick
    seeds, students, names = (2, 10, ["phong_matte"]) if quick else (40, STUDENTS, [*TESTS])
    seconds = seconds_of_class(students)
    with ProcessPoolExecutor() as pool:
        found = {
            "honest": dict(zip(names, pool.map(partial(honest, seeds), names), strict=True)),
            "attacks": dict(zip(names, pool.map(attacks, names), strict=True)),
            "likeness": dict(zip(ALIKE, pool.map(partial(likeness, max(seeds, 12)), ALIKE), strict=True)),
        }
    rows = [(part, name, dict(counts)) for part, tests in found.items() for name, counts in tests.items()]
    show(f"Grading: {students} submissions in {seconds:.1f} s", ("part", "test", "pictures"), rows)
    keep("grading", {"class": {"students": students, "seconds": seconds}, **found})


if __name__ == "__main__":
    main()
