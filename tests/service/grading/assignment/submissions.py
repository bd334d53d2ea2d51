"""Submissions to the ready assignment: a correct one, and wrong ones with one mistake each."""

from functools import cache
from pathlib import Path
from tempfile import mkdtemp

from PIL import Image

from scenes.make_assignment_parts import FOLDER, Json
from scenes.make_assignment_rays import SHOWN_NORMALS
from tests.service.grading.assignment import program
from tests.service.grading.assignment.program import SAMPLES
from tests.service.grading.assignment.shapes import Wrong


def document(name: str) -> Json:
    return program.read(FOLDER, name)


def write(folder: Path, wrong: Wrong = frozenset(), samples: int = SAMPLES, seed: int = 0) -> None:
    """Write all files of a submission."""
    program.run(FOLDER, folder, wrong, samples, seed)
    for name in SHOWN_NORMALS:
        codes = program.normal_codes(FOLDER, name, wrong, samples, seed)
        Image.fromarray(codes).save(folder / f"{name}_normals.png")


def save(folder: Path, name: str, wrong: Wrong = frozenset(), samples: int = SAMPLES, seed: int = 0) -> None:
    """Save the submitted file for a scene: a picture or hits."""
    program.save(FOLDER, folder, name, wrong, samples, seed)


@cache
def right(samples: int = SAMPLES, seed: int = 0) -> Path:
    """A folder with the correct submission, made once per session."""
    folder = Path(mkdtemp(prefix="assignment-"))
    write(folder, samples=samples, seed=seed)
    return folder
