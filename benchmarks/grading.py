"""The grader on the ready assignment: a class of 200, honest pictures, attacks, and copies within a class.

``python -m benchmarks.grading`` takes some twenty minutes on two idle cores, prints a table, and writes
out/grading.json. ``--quick`` tries a twentieth. The submissions are made with this renderer, by its random
patterns and with other seeds than the references; mistakes are made in the scenes or in the pictures.
tests/service/grading/assignment does the same with a ray tracer that shares no code with the grader.
"""

from __future__ import annotations

import io
import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image, ImageFilter

import renderer
from accuracy.comparison import Picture, picture_of
from accuracy.study.journal import describe
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
    from collections.abc import Callable, Iterable, Iterator

    from service.grading.outcomes import Outcome

    Array = np.ndarray[Any, Any]
    Alter = Callable[[Array, np.random.Generator], Array]

ROOT = Path(__file__).parents[1]
ASSIGNMENT = ROOT / "scenes" / "assignment"
MANIFEST = read_manifest((ASSIGNMENT / "manifest.yaml").read_bytes(), yaml=True)
TESTS = {Path(test.submitted.file).stem: test for test in MANIFEST.tests if isinstance(test, ImageTest)}

Json = dict[str, Any]

SAMPLES = 16
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


SCENES: dict[str, Callable[[Json], Json]] = {
    "no ambient term": lambda document: document | {"ambient": [0, 0, 0]},
    "hard shadows": _points,
    "twice the shininess": _shinier,
    "twice the field of view": _wider,
    "a shape is missing": lambda document: document | {"shapes": document["shapes"][:-1]},
    "no anti-aliasing": lambda document: (
        document | {"sampling": document["sampling"] | {"antialiasing": {"pattern": "center", "samples": 1}}}
    ),
}
"""Mistakes that are made in a scene."""

PICTURES: dict[str, Callable[[Array], Array]] = {
    "upside down": lambda linear: linear[::-1],
    "blue and red swapped": lambda linear: linear[:, :, ::-1],
    "a tenth too bright": lambda linear: 1.1 * linear,
    "one pixel off": lambda linear: np.roll(linear, 1, 1),
    "encoded twice": lambda linear: srgb_from_linear(np.clip(linear, 0, 1)),
}
"""Mistakes that are made in a linear picture."""

WRONG = (*SCENES, *PICTURES)


def picture(name: str, wrong: str = "", samples: int = SAMPLES, seed: int = 0) -> Array:
    """A picture as a program makes it, 8-bit codes (H, W, 3)."""
    scene = renderer.load_scene(ASSIGNMENT / f"{name}.json")
    document = scene.document.model_dump(mode="json", exclude_unset=True)
    pattern = "stratified" if name == "antialiasing_advanced" else "random"
    document["sampling"] = {
        "antialiasing": {"pattern": pattern, "samples": samples},
        "light": {"pattern": "random", "samples": 1},
        "seed": seed + 1000,
    }
    if wrong in SCENES:
        document = SCENES[wrong](document)
    plan = renderer.compile_scene(LoadedScene(Scene.model_validate(document), scene.assets))
    linear = renderer.render(plan).image.astype(np.float64)
    return codes_of(PICTURES[wrong](linear) if wrong in PICTURES else linear)


def codes_of(linear: Array) -> Array:
    """Encode a linear picture as 8-bit sRGB."""
    return np.rint(255 * srgb_from_linear(np.clip(linear, 0, 1))).astype(np.uint8)


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


def of_class(students: int) -> Json:
    """Grade a class in a process of its own, and count the seconds."""
    with tempfile.TemporaryDirectory() as place, ProcessPoolExecutor() as pool:
        folder, marks = Path(place, "class"), Path(place, "marks")
        runs = -(-students // COPIES)
        made = [("", *WRONG)[number % (1 + len(WRONG))] for number in range(runs)]
        list(pool.map(partial(submit, folder), range(runs), made))
        for student in range(students):
            number, copy = divmod(student, COPIES)
            if copy:
                copied(folder / f"student {number}.0", folder / f"student {number}.{copy}", student)
        begun, before = time.perf_counter(), _cpu_seconds()
        command = [sys.executable, "-m", "service.cli.main", "grade", str(ASSIGNMENT / "manifest.yaml")]
        subprocess.run(
            [*command, "--class", str(folder), "-o", str(marks)],
            cwd=ROOT,
            check=True,
            stdout=subprocess.DEVNULL,
        )
        seconds, own = time.perf_counter() - begun, _cpu_seconds() - before
        grades = {
            file.parent.name: json.loads(file.read_text()) for file in marks.glob("students/*/result.json")
        }
    scores: dict[str, set[float]] = {}
    for name, grade in grades.items():
        number = int(name.removeprefix("student ").split(".")[0])
        scores.setdefault(made[number] or "right", set()).add(grade["score"])
    tests = sum(grade["timings"]["cpu_seconds"] for grade in grades.values())
    return {
        "students": len(grades),
        "seconds": round(seconds, 1),
        "cpu_seconds": round(tests + own, 1),
        "scores": {program: [min(found), max(found)] for program, found in scores.items()},
    }


def _cpu_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def graded(name: str, codes: Array) -> Outcome:
    """Points of a picture before its mistakes are reproduced with the scene."""
    with tempfile.TemporaryDirectory() as place:
        Image.fromarray(codes).save(Path(place, f"{name}.png"), compress_level=1)
        folders = Folder(ASSIGNMENT.resolve(), "reference"), Folder(Path(place).resolve(), "submission")
        return next(iter(findings(TESTS[name], Run(MANIFEST, *folders))))


def _signals(outcomes: Iterable[Outcome]) -> dict[str, int]:
    return dict(Counter(code for each in outcomes for code in {signal.code for signal in each.signals}))


def honest(seeds: int, name: str) -> Iterator[Json]:
    """Count right pictures that lose points or raise a signal."""
    for samples in (4, 16, 64):
        found = [graded(name, picture(name, samples=samples, seed=seed)) for seed in range(seeds)]
        lost = sum(each.share < 1 for each in found)
        yield {"samples": samples, "pictures": seeds, "lost": lost, "signals": _signals(found)}


def _gaussian(deviation: float) -> Alter:
    return lambda codes, random: codes + deviation * random.normal(size=codes.shape)


def _blurred(codes: Array, radius: float) -> Array:
    return np.asarray(Image.fromarray(codes).filter(ImageFilter.GaussianBlur(radius)))


NOISE: dict[str, Alter] = {
    **{f"Gaussian {deviation}": _gaussian(deviation) for deviation in (5, 12, 25, 50)},
    "uniform 25": lambda codes, random: codes + random.uniform(-43, 43, codes.shape),
    "multiplied by 1 +- 0.3": lambda codes, random: codes * (1 + 0.3 * random.normal(size=codes.shape)),
    "salt": lambda codes, random: np.where(random.random(codes.shape[:2])[:, :, None] < 0.1, 255, codes),
    "blurred": lambda codes, _: _blurred(codes, 1),
}
"""Attacks that hide the mistake of a wrong picture."""


def attacks(name: str) -> Json:
    """Points of wrong pictures with noise or a blur, and copies of the reference that raise a signal."""
    random, more, tried = np.random.default_rng(1), [], []
    for wrong in WRONG:
        codes = picture(name, wrong)
        plain = graded(name, codes)
        for kind, alter in NOISE.items():
            found = graded(name, _rounded(alter(codes, random)))
            tried.append(found)
            if found.share > plain.share:
                more.append([wrong, kind, found.share - plain.share])
    with np.load(ASSIGNMENT / "references" / f"{name}.npz") as kept:
        right = codes_of(kept["image"].astype(np.float64))
    copies = {
        deviation: bool(graded(name, _rounded(right + deviation * random.normal(size=right.shape))).signals)
        for deviation in (0, 1, 2, 4)
    }
    return {"pictures": len(tried), "earn more": more, "signals": _signals(tried), "copies": copies}


def _rounded(codes: Array) -> Array:
    return np.clip(np.rint(codes), 0, 255).astype(np.uint8)


ALTERED: dict[str, Callable[[Array], Array]] = {
    "saved again": lambda codes: codes,
    "3 % brighter": lambda codes: _rounded(1.03 * codes),
    "noise of 2 codes": lambda codes: _rounded(codes + np.random.default_rng(1).normal(0, 2, codes.shape)),
    "noise of 5 codes": lambda codes: _rounded(codes + np.random.default_rng(1).normal(0, 5, codes.shape)),
    "JPEG of quality 90": lambda codes: _compressed(codes, 90),
    "blurred by half a pixel": lambda codes: _blurred(codes, 0.5),
}


def _compressed(codes: Array, quality: int) -> Array:
    file = io.BytesIO()
    Image.fromarray(codes).save(file, "JPEG", quality=quality)
    return np.asarray(Image.open(file))


def _seen(codes: Array) -> Picture:
    file = io.BytesIO()
    Image.fromarray(codes).save(file, "PNG")
    return picture_of(file.getvalue(), "picture.png", "srgb")


def likeness(seeds: int, name: str) -> Json:
    """Honest pictures of a class that seem to share their noise, and altered copies that are found."""
    with np.load(ASSIGNMENT / "references" / f"{name}.npz") as kept:
        file = io.BytesIO()
        np.save(file, kept["image"].astype(np.float32))
    reference = picture_of(file.getvalue(), "reference.npy", "linear")
    codes = [picture(name, seed=seed) for seed in range(seeds)]
    prints = [fingerprint(_seen(each), reference) for each in codes]
    found: Json = {"pairs": seeds * (seeds - 1) // 2, "alarms": len(_pairs(prints)), "copies": seeds // 4}
    for how, alter in ALTERED.items():
        copies = [fingerprint(_seen(alter(each)), reference) for each in codes[: seeds // 4]]
        alike = _pairs([*prints, *copies])
        found[how] = sum((place, seeds + place) in alike for place in range(seeds // 4))
    return found


def _pairs(prints: list[Any]) -> set[tuple[int, int]]:
    noise = noise_of(prints)
    return set() if noise is None else {(pair.first, pair.second) for pair in pairs(noise)}


def main() -> None:
    """Measure, print and write."""
    quick = "--quick" in sys.argv[1:]
    seeds, students, names = (2, 10, ["phong_matte"]) if quick else (40, STUDENTS, [*TESTS])
    found: Json = {"machine": describe(), "class": of_class(students)}
    with ProcessPoolExecutor() as pool:
        alike = ["phong_highlights", "shadow_soft"]
        found["likeness"] = dict(zip(alike, pool.map(partial(likeness, max(seeds, 12)), alike), strict=True))
        found["honest"] = dict(zip(names, pool.map(_all_honest, [seeds] * len(names), names), strict=True))
        found["attacks"] = dict(zip(names, pool.map(attacks, names), strict=True))
    sys.stdout.write("\n".join(lines(found)) + "\n")
    out = ROOT / "out" / "grading.json"
    out.parent.mkdir(exist_ok=True)
    out.write_text(json.dumps(found, indent=1) + "\n")


def lines(found: Json) -> Iterator[str]:
    """The table."""
    yield f"{found['class']['students']} submissions in {found['class']['seconds']} s"
    for program, (least, most) in found["class"]["scores"].items():
        yield f"  {program:24} {least:g} to {most:g} points"
    for name, parts in found["honest"].items():
        lost = ", ".join(f"{part['lost']} of {part['pictures']}" for part in parts)
        attack = found["attacks"][name]
        more = f"{len(attack['earn more'])} of {attack['pictures']} attacks earn more"
        yield f"{name:24} right pictures that lose points: {lost}; {more}; copies {attack['copies']}"
    for name, counts in found["likeness"].items():
        yield f"{name:24} {counts}"


def _all_honest(seeds: int, name: str) -> list[Json]:
    return list(honest(seeds, name))


if __name__ == "__main__":
    main()
