"""The grader on the ready assignment: honest pictures, attacks, and a class of 200 with 24 wrong programs.

All parts take some fifteen minutes on two idle cores; ``--most 3`` tries three submissions of each.
"""

from __future__ import annotations

import io
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache, partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from benchmarks.grading_attacks import COPIED, DAMAGED, EMPTY, HIDDEN, sheet
from benchmarks.grading_programs import (
    ASSIGNMENT,
    MANIFEST,
    RIGHT,
    TESTS,
    WRONG,
    Program,
    hand_in,
    hits,
    picture,
    save,
)
from benchmarks.report import SCENES, Promise, conclude, parser, show
from schemas.grading.manifest_reading import read_manifest
from schemas.grading.manifests import RaysTest
from service.grading.errors import GradingError
from service.grading.folders import Folder
from service.grading.grading import findings, grade
from service.grading.programs.program_search import search
from service.grading.settings import Run

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from benchmarks.grading_attacks import Attack
    from benchmarks.grading_programs import Array
    from benchmarks.report import Json
    from schemas.grading.manifests import Criterion

    Points = dict[str, tuple[float, bool]]

CORES = os.cpu_count() or 1
HONEST, STUDENTS, COPIES = 500, 200, 5
"""Honest pictures, submissions of the class, and how many of those are copies of one run, other last bits."""

CLASS_SECONDS = 300
FAULTS = {"no lights": Program(scene=lambda scene: scene | {"lights": []})} | {
    name: WRONG[name] for name in ("no ambient term", "hard shadows")
}
"""Programs whose pictures attacks start from."""


def points(folder: Path, tests: Iterable[Criterion] = tuple(TESTS.values())) -> Points:
    """Points of each test before mistakes are reproduced, and whether staff get a signal."""
    folders = Folder(ASSIGNMENT.resolve(), "reference"), Folder(folder.resolve(), "submission")
    run = Run(MANIFEST, *folders)
    run = replace(run, mistakes=search(run))
    found = {}
    for test in tests:
        try:
            outcome = next(findings(test, run))
            found[test.id] = test.points * outcome.share, bool(outcome.signals)
        except GradingError:
            found[test.id] = 0.0, False
    return found


def _total(found: Points) -> float:
    return sum(earned for earned, _ in found.values())


def _honest(number: int) -> tuple[int, Points]:
    samples = (4, 16, 64)[number % 3]
    with tempfile.TemporaryDirectory() as place:
        return samples, points(hand_in(Path(place, "honest"), RIGHT, samples, number))


def honest(most: int) -> Iterator[Promise]:
    """Right programs with 4, 16 and 64 samples a pixel."""
    lost, signals, pictures = list[str](), 0, 0
    full = {test.id: test.points for test in TESTS.values()}
    with ProcessPoolExecutor(CORES) as pool:
        for samples, found in pool.map(_honest, range(min(most, -(-HONEST // len(TESTS))))):
            pictures += len(found)
            signals += sum(signal for _, signal in found.values())
            lost += [f"{name} at {samples}" for name, (one, _) in found.items() if one < full[name]]
    yield _none(f"{pictures} honest pictures of 4, 16 and 64 samples lose no points.", lost)
    yield Promise("They give no signal.", str(signals), "0", not signals)


def attacks(most: int) -> Iterator[Promise]:
    """Wrong pictures with their mistake hidden, empty ones, altered references, and other kinds of tests."""
    trials = [*islice(((fault, name) for fault, names in STARTS.items() for name in names), most)]
    with ProcessPoolExecutor(CORES) as pool:
        plain = dict(
            zip(FAULTS, map(_total, pool.map(_attacked, FAULTS, [AS_IT_IS] * len(FAULTS))), strict=True)
        )
        found = pool.map(_attacked, *zip(*trials, strict=True))
        rows = [
            (name, fault, plain.get(fault, 0.0), _total(one), _unnoticed(one, fault))
            for (fault, name), one in zip(trials, found, strict=True)
        ]
    rows += [(name, "", 0.0, *attack()) for name, attack in OTHERS.items()]
    show("Attacks", ("attack", "of", "honest points", "points", "without a signal"), rows)
    more = [f"{name} {fault}".strip() for name, fault, allowed, _, earned in rows if earned > allowed]
    yield _none(f"None of {len(rows)} attacks earns more than the honest fault without a signal.", more)


AS_IT_IS = "as it is"
ATTACKS: dict[str, Attack] = {AS_IT_IS: lambda one: one.picture, **HIDDEN, **EMPTY, **COPIED, **DAMAGED}
STARTS = {
    **dict.fromkeys(FAULTS, HIDDEN),
    "nothing": EMPTY,
    "the reference": COPIED,
    "the right picture": DAMAGED,
}
"""Attacks by what they start from. All but the first earn nothing honestly."""


@cache
def _pictures(start: str) -> dict[str, Array]:
    """Pictures of all tests; the faults of copies and of nothing do not matter."""
    program = RIGHT if start == "the right picture" else FAULTS.get(start, FAULTS["no lights"])
    return {name: picture(name, program) for name in TESTS}


def _attacked(start: str, name: str) -> Points:
    with tempfile.TemporaryDirectory() as place:
        for seed, (test, codes) in enumerate(_pictures(start).items()):
            save(Path(place), test, ATTACKS[name](sheet(test, codes, seed)))
        return points(Path(place))


def _unnoticed(found: Points, start: str) -> float:
    """Points of a submission for which staff get no signal; one does not excuse a hidden mistake."""
    excused = start == "the reference" and any(signal for _, signal in found.values())
    return 0.0 if excused else _total(found)


def _jittered() -> tuple[float, float]:
    """Points of hits that are right to four digits."""
    random = np.random.default_rng(1)
    tests = [test for test in MANIFEST.tests if isinstance(test, RaysTest)]
    with tempfile.TemporaryDirectory() as place:
        for name, content in hits().items():
            with np.load(io.BytesIO(content)) as right:
                wrong = {
                    key: values * (1 + 1e-4 * random.normal(size=values.shape)) if key != "shape" else values
                    for key, values in right.items()
                }
            np.savez(Path(place, name), **wrong)
        earned = _total(points(Path(place), tests))
    return earned, earned


def _handed_in(scene: Json, files: dict[str, bytes]) -> tuple[float, float]:
    """Points of a scene in a test of the scene and one of its time."""
    accept = {"full": 1000}
    submitted = {"file": "scene.json"}
    reference = {"type": "scene", "file": "shadow_hard.json"}
    tests = [
        {"id": "scene", "name": "A scene", "kind": "scene", "submitted": submitted, "reference": reference},
        {"id": "time", "name": "Its time", "kind": "time", "submitted": submitted, "accept": accept},
    ]
    document = {
        "schema": "penumbra/manifest/v1",
        "title": "A scene",
        "tests": [test | {"points": 10} for test in tests],
    }
    manifest = read_manifest(json.dumps(document).encode(), yaml=False)
    with tempfile.TemporaryDirectory() as place:
        for name, content in {"scene.json": json.dumps(scene).encode(), **files}.items():
            (Path(place) / name).write_bytes(content)
        found = grade(manifest, references=ASSIGNMENT, submission=Path(place)).grade
    return found.score, 0.0 if found.signals else found.score


EMPTY_SCENE = {"version": 1, "camera": {"position": [0, 0, 1], "look_at": [0, 0, 0], "width": 1, "height": 1}}


def _textured() -> tuple[float, float]:
    """Points of a rectangle that carries the reference and fills the picture."""
    scene = json.loads((ASSIGNMENT / "shadow_hard.json").read_text())
    width, height = (scene["camera"][side] for side in ("width", "height"))
    up = 2 * math.tan(math.radians(scene["camera"]["vertical_fov"]) / 2)
    scene["camera"] |= {"position": [0, 0, 1], "look_at": [0, 0, 0], "up": [0, 1, 0]}
    scene["textures"] = {
        "copy": {"type": "image", "asset": "copy.png", "encoding": "srgb", "filter": "nearest"}
    }
    scene["materials"] = {"copy": {"type": "phong", "color_texture": "copy", "ambient": 1, "diffuse": 0}}
    scene["shapes"] = [
        {"type": "rectangle", "center": [0, 0, 0], "normal": [0, 0, 1], "tangent": [1, 0, 0]}
        | {"size": [up * width / height, up], "material": "copy"}
    ]
    scene["lights"] = []
    reference = (ASSIGNMENT / "references" / "shadow_hard.png").read_bytes()
    return _handed_in(scene | {"ambient": [1, 1, 1]}, {"copy.png": reference})


OTHERS: dict[str, Callable[[], tuple[float, float]]] = {
    "hits with jitter": _jittered,
    "an empty scene in a time test": partial(_handed_in, EMPTY_SCENE, {}),
    "the reference as a texture": _textured,
}
"""Attacks on other tests: their points, and those without a signal."""


def submit(folder: Path, number: int) -> None:
    """Write a run of the class and its copies; a tenth of the codes of a copy are larger by one."""
    wrong = number < len(WRONG)
    name, program = [*WRONG.items()][number] if wrong else ("right", RIGHT)
    first = hand_in(folder / f"{name} {number}.0", program, seed=number)
    for copy in range(1, COPIES):
        random = np.random.default_rng([number, copy])
        other = shutil.copytree(first, folder / f"{name} {number}.{copy}")
        for test in TESTS:
            codes = np.asarray(Image.open(first / f"{test}.png"))
            more = (codes < 255) & (random.random(codes.shape) < 0.1)
            save(other, test, codes + more.astype(np.uint8))


def whole_class(most: int) -> Iterator[Promise]:
    """A class as the command grades it: 24 wrong programs and 16 right ones, each handed in by five."""
    runs = min(STUDENTS // COPIES, most)
    with tempfile.TemporaryDirectory() as place, ProcessPoolExecutor(CORES) as pool:
        list(pool.map(partial(submit, Path(place, "class")), range(runs)))
        command = [sys.executable, "-m", "service.cli.main", "grade", str(ASSIGNMENT / "manifest.yaml")]
        command += ["--class", str(Path(place, "class")), "-o", str(Path(place, "marks"))]
        command += ["--jobs", str(CORES)]
        begun = time.perf_counter()
        subprocess.run(command, cwd=SCENES.parent, check=True, stdout=subprocess.DEVNULL)
        seconds = time.perf_counter() - begun
        shared = json.loads(Path(place, "marks", "class.json").read_text())["shared_noise"]
        results = Path(place, "marks", "students").glob("*/result.json")
        grades = [json.loads(file.read_text()) for file in results]
    title = f"A class of {runs * COPIES} is graded in five minutes."
    yield Promise(title, f"{seconds:.1f} s", f"{CLASS_SECONDS} s", seconds <= CLASS_SECONDS)
    groups = [{name.rpartition(".")[0] for name in each["students"]} for each in shared]
    yield _none("Only copies are said to share their noise.", [str(each) for each in groups if len(each) > 1])
    yield from _named(grades)


def _named(grades: list[Json]) -> Iterator[Promise]:
    """Whether tests that lose points name the mistake of the program, and no other."""
    wrong, missed, misnamed = set[str](), set[str](), set[str]()
    rows = []
    for result in sorted(grades, key=lambda one: str(one["student"])):
        program = result["student"].rpartition(" ")[0]
        failed = [test for test in result["tests"] if test["points"] < test["max_points"]]
        named = {test["diagnosis"][0]["cause"] for test in failed if test["diagnosis"]}
        rows.append((result["student"], result["score"], ", ".join(sorted(named))))
        right = {WRONG[program].cause} if program in WRONG else set[str]()
        wrong |= {program} & WRONG.keys()
        missed |= {program} if right - named else set()
        misnamed |= {program} if named - right else set()
    show("Programs with one mistake", ("student", "points of 125", "named"), rows[::COPIES])
    yield _none(f"The mistakes of {len(wrong)} wrong programs are named.", sorted(missed))
    yield _none("None is named wrongly.", sorted(misnamed))


def _none(promise: str, exceptions: list[str]) -> Promise:
    measured = f"{len(exceptions)}: {', '.join(exceptions)}" if exceptions else "0"
    return Promise(promise, measured, "0", not exceptions)


PARTS = {"honest": honest, "attacks": attacks, "class": whole_class}


def main() -> None:
    """Measure the requested parts on an idle machine; 1 if a promise is not held."""
    options = parser("grading", __doc__)
    options.add_argument("parts", nargs="*", default=[*PARTS], metavar="PART", help=", ".join(PARTS))
    options.add_argument("--most", type=int, default=STUDENTS, help="submissions of each part")
    chosen = options.parse_args()
    conclude("grading", [one for part in chosen.parts for one in PARTS[part](chosen.most)])


if __name__ == "__main__":
    main()
