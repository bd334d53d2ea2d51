"""Submissions downloaded from Canvas or Moodle: sorted into a folder for each student, archives unpacked."""

from __future__ import annotations

import os
import re
import shutil
import zipfile
from collections import defaultdict
from collections.abc import Collection, Iterator
from pathlib import Path, PurePosixPath

from service.grading.classes.class_records import Student
from service.grading.folders import MOST_BYTES, MOST_FILES, is_hidden, readable

NAMES = (
    re.compile(r"(?P<name>.+)_(?P<number>\d+)_assignsubmission_file_?(?P<file>.*)"),
    re.compile(r"(?:LATE_)?(?P<name>anon)_(?P<number>[0-9A-Za-z]+)_\d+_(?P<file>.+)"),
    # A name may have marks, such as accents and vowels of Hindi, which are no \w.
    re.compile(r"(?P<name>[^\s.]+?)_(?:LATE_)?(?P<number>\d+)_\d+_(?P<file>.+)"),
)
"""Names in a download of Moodle (full name and participant, or group and its number; a folder or each file:
https://github.com/moodle/moodle/blob/main/mod/assign/classes/downloader.php) and of Canvas (name, LATE, user,
attachment, file: https://github.com/instructure/canvas-lms/blob/master/lib/content_zipper.rb).
"""

AGAIN = re.compile(r"-\d+(?=\.[^.]*$)")
"""Suffix of a file that is handed in again on Canvas: p-1.png."""


def sorted_download(
    folder: Path, into: Path, wanted: Collection[str]
) -> tuple[tuple[Student, ...], tuple[str, ...], list[str]]:
    """Copy the submissions of a download into folders.

    Parameters
    ----------
    into
        An empty folder.
    wanted
        The names of files that the assignment asks for.

    Returns
    -------
    tuple
        The submissions, none if no name is that of a download; other files and folders; and sentences about
        archives that are not unpacked.
    """
    found, others, troubles = defaultdict[Student, list[tuple[Path, str]]](list), [], list[str]()
    for path in sorted(folder.iterdir()):
        match = next(filter(None, (names.fullmatch(path.name) for names in NAMES)), None)
        # Links might lead anywhere.
        if match and not path.is_symlink() and (path.is_file() if match["file"] else path.is_dir()):
            student = Student(into / f"{match['name']}_{match['number']}", match["number"])
            found[student] += [(path, match["file"])] if match["file"] else _inside(path)
        elif not is_hidden(path.name):
            others.append(readable(path.name))
    for student, files in found.items():
        student.folder.mkdir()
        # Files that have a wanted name come before copies of them.
        for source, name in sorted(files, key=lambda each: each[1] not in wanted):
            _take(source, student.folder, name, wanted, troubles)
    return tuple(found), tuple(others), troubles


def _inside(folder: Path) -> Iterator[tuple[Path, str]]:
    """The files in a folder, with their names there."""
    for place, _, files in os.walk(folder):
        for path in (Path(place, name) for name in files):
            if path.is_file() and not path.is_symlink():
                yield path, path.relative_to(folder).as_posix()


def _take(source: Path, place: Path, name: str, wanted: Collection[str], troubles: list[str]) -> None:
    """Copy a file of a student, or unpack it."""
    if name.lower().endswith(".zip") and name not in wanted:
        try:
            _unpack(source, place, wanted)
        except Exception as error:  # noqa: BLE001 - archives may be damaged in any way
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
        files = [
            (info, PurePosixPath(info.filename).parts) for info in archive.infolist() if not info.is_dir()
        ]
        if any(part in {"..", "/"} or {*"\\:"} & {*part} for _, parts in files for part in parts):
            raise ValueError("a name in it leads out of its folder.")
        files = [(info, parts) for info, parts in files if not any(map(is_hidden, parts))]
        if len(files) > MOST_FILES or sum(info.file_size for info, _ in files) > MOST_BYTES:
            raise ValueError(f"it has more than {MOST_FILES} files or {MOST_BYTES} bytes.")
        outer = {parts[0] if len(parts) > 1 else "" for _, parts in files}
        is_wrapped = len(outer) == 1 and not any(name.split("/")[0] in outer for name in wanted)
        for info, parts in files:
            target = place.joinpath(*parts[is_wrapped and "" not in outer :])
            target.parent.mkdir(parents=True, exist_ok=True)
            with archive.open(info) as packed, target.open("xb") as file:
                shutil.copyfileobj(packed, file)
            shutil.copystat(source, target)
