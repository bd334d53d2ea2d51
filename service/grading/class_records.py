"""What is kept of a class: which submissions were graded before, by which assignment."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from pydantic import ValidationError

from accuracy.comparison.inputs import SIDECARS
from schemas.grading.grades import Grade
from schemas.grading.manifests import (
    ImageTest,
    Manifest,
    RaysFile,
    RaysTest,
    ReferencePicture,
    ReferenceScene,
    SceneTest,
)
from service.grading.errors import GradingError
from service.grading.folders import Folder
from service.grading.names import is_hidden, readable

RESULT, KEY = "result.json", "graded.key"


@dataclass(frozen=True, slots=True)
class Student:
    """A submission of a class.

    Attributes
    ----------
    folder : Path
        Its name is that of the student.
    """

    folder: Path

    @property
    def name(self) -> str:
        """The name of the folder as text."""
        return readable(self.folder.name)


def students_of(folder: Path) -> tuple[Student, ...]:
    """The submissions of a class, by name: its folders, but no hidden ones, and no links."""
    with os.scandir(folder) as entries:
        names = [
            entry.name
            for entry in entries
            if entry.is_dir(follow_symlinks=False) and not is_hidden(entry.name)
        ]
    return tuple(Student(folder / name) for name in sorted(names))


def assignment_key(manifest: Manifest, references: Path) -> str:
    """A hash of all that decides a grade except the submission."""
    folder = Folder(references.resolve(), "reference")
    files = {name: _content(folder, name) for name in sorted(set(_names(manifest)))}
    parts = [version("penumbra-render"), manifest.model_dump(mode="json"), files]
    return _hashed(json.dumps(parts, sort_keys=True).encode())


def submission_key(assignment: str, student: Student) -> str:
    """A hash of the assignment and of the names, sizes and times of all files of a submission."""
    lines = sorted(_listed(student.folder))
    return _hashed(b"\0".join([assignment.encode(), os.fsencode(student.folder.name), *lines]))


def graded_before(place: Path, key: str) -> Grade | None:
    """The result in a folder, if it is complete and has this key."""
    try:
        if (place / KEY).read_text() != key:
            return None
        return Grade.model_validate_json((place / RESULT).read_bytes())
    except (OSError, UnicodeDecodeError, ValidationError):
        return None


def _names(manifest: Manifest) -> Iterator[str]:
    """The files beside the manifest that tests name."""
    for test in manifest.tests:
        if isinstance(test, RaysTest):
            yield test.reference
            if isinstance(test.rays, RaysFile):
                yield test.rays.file
        elif isinstance(test, ImageTest | SceneTest):
            yield from _of_reference(test.reference)
            if test.mask is not None:
                yield test.mask


def _of_reference(reference: ReferencePicture | ReferenceScene) -> Iterator[str]:
    yield reference.file
    if isinstance(reference, ReferencePicture):
        yield from (f"{reference.file}.{layer}.npy" for layer in SIDECARS)
        if reference.scene is not None:
            yield reference.scene


def _content(folder: Folder, name: str) -> object:
    """A hash of a file, or of a scene with all files that it names; what is wrong with a damaged one."""
    # Only classes are packed, so grading one submission does not wait for the client to load.
    from schemas.errors import SceneError  # noqa: PLC0415
    from service.client.parcels import pack  # noqa: PLC0415

    try:
        content = folder.read(name)
        if not name.endswith(".json"):
            return _hashed(content)
        return pack(content, assets=folder.assets(name)).document
    except (GradingError, SceneError) as error:
        return str(error)


def _listed(folder: Path) -> Iterator[bytes]:
    for inside, _, files in os.walk(folder):
        for name in files:
            path = Path(inside, name)
            status = path.lstat()
            words = f"{status.st_size} {status.st_mtime_ns} "
            yield words.encode() + os.fsencode(path.relative_to(folder))


def _hashed(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
