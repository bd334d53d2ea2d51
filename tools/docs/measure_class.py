"""How long a class takes: ``penumbra grade --class`` on 200 submissions to the ready assignment.

``python -m tools.docs.measure_class`` runs a simple ray tracer, right with 16 seeds and with each of its
mistakes once, copies each submission four times with other noise in its last bits, grades all of them in a
process of its own, and saves the figures in docs/figures/class.json. Leave the machine alone until it ends.
A number after it grades only so many submissions, and saves nothing.
"""

from __future__ import annotations

import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from accuracy.study.journal import describe
from tests.service.grading.assignment import program
from tests.service.grading.assignment.programs import PROGRAMS
from tools.docs.generate_assignment_page import ASSIGNMENT, MANIFEST, ROOT
from tools.docs.measure_likeness import save

STUDENTS, COPIES, RIGHT = 200, 5, 16
"""Submissions, how many of them are made of one run of the program, and how many of its runs are right."""


def main() -> None:
    """Make a class, grade it, print and save."""
    students = int(sys.argv[1]) if sys.argv[1:] else STUDENTS
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place, "class")
        wrong = make_class(folder, students)
        found = graded(folder, Path(place, "marks")) | {"right": students - wrong}
    print(json.dumps(found, indent=1))
    if not sys.argv[1:]:
        save("time", found)


def make_class(folder: Path, students: int) -> int:
    """Write all submissions, and return how many of them are wrong."""
    runs = ([()] * RIGHT + [(wrong.name,) for wrong in PROGRAMS])[: -(-students // COPIES)]
    with ProcessPoolExecutor() as pool:
        list(pool.map(partial(run, folder), range(len(runs)), runs))
    for student in range(students):
        number, copy = divmod(student, COPIES)
        if copy:
            altered(folder / f"student {number}.0", folder / f"student {number}.{copy}", student)
    return sum(bool(runs[student // COPIES]) for student in range(students))


def run(folder: Path, number: int, wrong: tuple[str, ...]) -> None:
    """Write the submission of one run."""
    program.run(ASSIGNMENT, folder / f"student {number}.0", frozenset(wrong), seed=number)


def altered(source: Path, target: Path, seed: int) -> None:
    """Copy a submission with other noise: some codes of its pictures are larger by one."""
    shutil.copytree(source, target)
    random = np.random.default_rng(seed)
    for file in target.glob("*.png"):
        codes = np.asarray(Image.open(file))
        Image.fromarray(codes + ((codes < 255) & (random.random(codes.shape) < 0.1)).astype(np.uint8)).save(
            file
        )


def graded(folder: Path, marks: Path) -> dict[str, Any]:
    """Grade a class, and count the seconds."""
    machine = describe()
    begun, before = time.perf_counter(), cpu_seconds()
    command = [sys.executable, "-m", "service.cli.main", "grade", str(MANIFEST), "--class", str(folder)]
    subprocess.run([*command, "-o", str(marks)], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    seconds = time.perf_counter() - begun
    results = [json.loads(file.read_text()) for file in marks.glob("students/*/result.json")]
    # The tests run in processes of a fork server, for which the command does not wait.
    own = cpu_seconds() - before
    tests = sum(result["timings"]["cpu_seconds"] for result in results)
    return {
        "machine": machine,
        "students": len(results),
        "seconds": round(seconds, 1),
        "cpu_seconds": round(tests + own, 1),
        "cpu_seconds_of_tests": round(tests, 1),
    }


def cpu_seconds() -> float:
    """Of all processes that this one has waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
