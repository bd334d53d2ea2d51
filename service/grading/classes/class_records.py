"""Records of a class: submissions that were graded before, and by which assignment."""

from __future__ import annotations

import hashlib
import html
import io
import json
import os
import re
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from accuracy.comparison.inputs import SIDECARS
from schemas.grading.grades import Grade
from schemas.grading.manifests import Manifest
from service.grading.adjustments import Correction
from service.grading.errors import GradingError
from service.grading.folders import MOST_BYTES, Folder, is_hidden, readable
from service.grading.grading import Graded
from service.grading.likeness.fingerprints import Fingerprint

FILE_FIELDS = frozenset({"file", "mask", "reference", "scene"})
"""Fields of a manifest that name files, if they are texts. Those of submissions are not found beside it."""

NOT_IN_FILES = re.compile(r"""[\x00-\x1f\x7f&<>"`|':\\/]""")
"""Characters that Moodle leaves out of names of files (``PARAM_FILE``)."""

RESULT, PRINTS, KEY = "result.json", "fingerprints.npz", "graded.key"
"""In the folder of each student; the key is written last."""


@dataclass(frozen=True, slots=True)
class Student:
    """A submission of a class.

    Attributes
    ----------
    folder : Path
        Its name is that of the student.
    number : str or None
        The student's number in the system that it was downloaded from.
    submitted : str or None
        ISO 8601.
    """

    folder: Path
    number: str | None = None
    submitted: str | None = None
    corrections: tuple[Correction, ...] = ()

    @property
    def name(self) -> str:
        """The name of the folder as text."""
        return readable(self.folder.name)

    @property
    def id(self) -> str:
        """The number, or the name if there is none."""
        return self.number or self.name

    def is_called(self, word: str) -> bool:
        """Whether a table means this student: by name or by number."""
        return word in {self.name, self.number}

    def is_group(self, word: str) -> bool:
        """Whether this is the download of a group of Moodle, which separates its parts by underscores."""
        # Moodle escapes a name for HTML before it cleans it for a file.
        escaped = html.unescape(word).replace("&", "&amp;").replace("_", " ")
        return self.name == f"{NOT_IN_FILES.sub('', escaped)}_{self.number}"


def submissions(folder: Path) -> tuple[tuple[Student, ...], tuple[str, ...]]:
    """The submissions of a class, by name, and the names of whatever else people see there.

    A submission is a folder. Links to folders are none: they might lead anywhere.
    """
    students, others = [], []
    with os.scandir(folder) as entries:
        for entry in sorted(entries, key=lambda each: each.name):
            if entry.is_dir(follow_symlinks=False) and not is_hidden(entry.name):
                students.append(Student(folder / entry.name))
            elif not is_hidden(entry.name):
                others.append(readable(entry.name))
    return tuple(students), tuple(others)


def assignment_key(manifest: Manifest, references: Path) -> str:
    """A hash of all that decides a grade except the submission."""
    folder = Folder(references.resolve(), "reference")
    document = manifest.model_dump(mode="json")
    files = {name: _content(folder, name) for name in sorted(set(_names(document)))}
    parts = [version("penumbra-render"), document, files]
    return _hashed(json.dumps(parts, sort_keys=True).encode())


def submission_key(assignment: str, student: Student) -> str:
    """A hash of the assignment and of the names and contents of all files of a submission."""
    lines = sorted(_listed(student.folder))
    words = repr((assignment, student.submitted, student.corrections)).encode()
    return _hashed(b"\0".join([words, os.fsencode(student.folder.name), *lines]))


def graded_before(place: Path, key: str) -> Graded | None:
    """The result in a folder, if it is complete and has this key; without its pictures."""
    try:
        if (place / KEY).read_text() != key:
            return None
        grade = Grade.model_validate_json((place / RESULT).read_bytes())
        return Graded(grade, {}, unpacked((place / PRINTS).read_bytes()))
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile):
        return None


def packed(prints: Mapping[str, Fingerprint]) -> bytes:
    """Fingerprints as an .npz file."""
    content = io.BytesIO()
    arrays: dict[str, Any] = {test: np.stack([each.detail, each.rounding]) for test, each in prints.items()}
    np.savez(content, **arrays)
    return content.getvalue()


def unpacked(content: bytes) -> dict[str, Fingerprint]:
    """Fingerprints from an .npz file.

    Raises
    ------
    EOFError, ValueError, KeyError, zipfile.BadZipFile
        It is not what `packed` writes.
    """
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return {test: Fingerprint(*arrays[test]) for test in arrays.files}


def _names(part: object) -> Iterator[str]:
    """The files that a part of a manifest names, as JSON values, and layers that may lie beside them."""
    if isinstance(part, list):
        for each in part:
            yield from _names(each)
    elif isinstance(part, dict):
        for key, value in part.items():
            if key in FILE_FIELDS and isinstance(value, str):
                yield from (value, *(f"{value}.{layer}.npy" for layer in SIDECARS))
            else:
                yield from _names(value)


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
    for inside, folders, files in os.walk(folder):
        for name in (*folders, *files):
            path = Path(inside, name)
            yield _digest(path) + os.fsencode(path.relative_to(folder))


def _digest(path: Path) -> bytes:
    """A hash of the content of a file, or whatever else stands for it."""
    try:
        if path.is_symlink():
            return os.fsencode(path.readlink()) + b" "
        status = path.lstat()
        if not path.is_file():
            # Reading a pipe would block.
            return f"{status.st_mode} ".encode()
        if status.st_size > MOST_BYTES:
            # No test opens it, and reading a sparse file may take hours.
            return f"{status.st_size} ".encode()
        with path.open("rb") as file:
            return hashlib.file_digest(file, hashlib.sha256).digest()
    except OSError as error:
        return f"{error.errno} ".encode()


def last_written(folder: Path) -> str | None:
    """The time of the newest file of a submission, ISO 8601; None without files."""
    times = [Path(inside, name).lstat().st_mtime for inside, _, files in os.walk(folder) for name in files]
    return datetime.fromtimestamp(max(times), UTC).isoformat(timespec="seconds") if times else None


def _hashed(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
