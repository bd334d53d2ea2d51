"""Submissions downloaded from Canvas or Moodle: sorted into a folder for each student, archives unpacked."""

from __future__ import annotations

import os
import re
import shutil
import zipfile
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from service.grading.classes.class_records import Student
from service.grading.folders import MOST_BYTES, MOST_FILES, is_hidden, readable

NAMES = (
    re.compile(r"(?P<name>.+)_(?P<number>\d+)_assignsubmission_file_?(?P<file>.*)"),
    re.compile(r"(?P<name>anon)_(?:LATE_)?(?P<number>[0-9A-Za-z]+)_\d+_(?P<file>.+)"),
    re.compile(r"(?P<name>\w+?)_(?:LATE_)?(?P<number>\d+)_\d+_(?P<file>.+)"),
)
"""Names in a download of Moodle (full name, participant, and a folder or each file) and of Canvas (name or
anon, LATE, user, attachment, file: https://github.com/instructure/canvas-lms/blob/master/lib/content_zipper.rb).
"""

AGAIN = re.compile(r"-\d+(?=\.[^.]*$)")
"""What Canvas adds to the name of a file that is handed in again: p-1.png."""


@dataclass(frozen=True, slots=True)
class Download:
    """The submissions of a download.

    Attributes
    ----------
    students : tuple of Student
    left_out : tuple of str
        Other files and folders.
    troubles : list of str
        Archives that were not unpacked, with reasons.
    """

    students: tuple[Student, ...]
    left_out: tuple[str, ...]
    troubles: list[str] = field(default_factory=list)


def sorted_download(folder: Path, into: Path, wanted: Collection[str]) -> Download | None:
    """Copy the submissions of a download into folders; None if no name in it is that of a download.

    Parameters
    ----------
    into
        An empty folder.
    wanted
        The names of files that the assignment asks for.
    """
    found, others = defaultdict[Student, list[tuple[Path, str]]](list), []
    for path in sorted(folder.iterdir()):
        match = _matched(path)
        if match is not None:
            place = into / f"{match['name']}_{match['number']}"
            found[Student(place, match["number"])].append((path, match["file"]))
        elif not is_hidden(path.name):
            others.append(readable(path.name))
    download = Download(tuple(found), tuple(others))
    for student, sources in found.items():
        student.folder.mkdir()
        for source, name in _exact_first(sources, wanted):
            _take(source, student.folder, name, wanted, download.troubles)
    return download if found else None


def _matched(path: Path) -> re.Match[str] | None:
    # Links might lead anywhere.
    if path.is_symlink():
        return None
    match = next(filter(None, (names.fullmatch(path.name) for names in NAMES)), None)
    # Folders have no names of files.
    return match if match and path.is_dir() == (not match["file"]) else None


def _exact_first(sources: Sequence[tuple[Path, str]], wanted: Collection[str]) -> Iterator[tuple[Path, str]]:
    """The files of a student with their own names: those that have a wanted name before copies of them."""
    files = [
        (path, name) if name else (path / inside, inside)
        for path, name in sources
        for inside in ([""] if name else _inside(path))
    ]
    return iter(sorted(files, key=lambda each: each[1] not in wanted))


def _inside(folder: Path) -> Iterator[str]:
    for place, folders, files in os.walk(folder):
        folders.sort()
        for path in (Path(place, name) for name in sorted(files)):
            if path.is_file() and not path.is_symlink():
                yield path.relative_to(folder).as_posix()


def _take(source: Path, place: Path, name: str, wanted: Collection[str], troubles: list[str]) -> None:
    """Copy a file of a student, or unpack it."""
    if name.lower().endswith(".zip") and name not in wanted:
        try:
            _unpack(source, place, wanted)
        except (
            zipfile.BadZipFile,
            OSError,
            ValueError,
            NotImplementedError,
            RuntimeError,
            EOFError,
        ) as error:
            troubles.append(f"{readable(source.name)} is not unpacked: {error}")
        return
    plain = AGAIN.sub("", name)
    is_meant = name not in wanted and plain in wanted and not (place / plain).exists()
    target = place / (plain if is_meant else name)
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy2(source, target)


def _unpack(source: Path, place: Path, wanted: Collection[str]) -> None:
    """Unpack an archive of a student, without the folder that all its files are in."""
    with zipfile.ZipFile(source) as archive:
        members = {info: PurePosixPath(info.filename).parts for info in archive.infolist()}
        if any(part in {"..", "/"} or {*"\\:"} & {*part} for parts in members.values() for part in parts):
            raise ValueError("a name in it leads out of its folder.")
        members = {
            info: parts
            for info, parts in members.items()
            if not info.is_dir() and not any(map(is_hidden, parts))
        }
        if len(members) > MOST_FILES or sum(info.file_size for info in members) > MOST_BYTES:
            raise ValueError(f"it has more than {MOST_FILES} files or {MOST_BYTES} bytes.")
        outer = {parts[0] for parts in members.values() if len(parts) > 1}
        is_wrapped = len(outer) == 1 and all(len(parts) > 1 for parts in members.values())
        if is_wrapped and not any(name.startswith(f"{next(iter(outer))}/") for name in wanted):
            members = {info: parts[1:] for info, parts in members.items()}
        for info, parts in members.items():
            target = place.joinpath(*parts)
            target.parent.mkdir(parents=True, exist_ok=True)
            with archive.open(info) as packed, target.open("xb") as file:
                shutil.copyfileobj(packed, file)
            shutil.copystat(source, target)
