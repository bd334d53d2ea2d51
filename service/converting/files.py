"""Files that an input names, and files that belong beside the new scene."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path

from renderer.similar_files import did_you_mean
from service.converting.errors import FileAwayError

_UNFIT = re.compile(r"[^A-Za-z0-9._-]+")
FARTHEST_ROOT = 2
"""Folders above the root up to which a wider one is offered: projects keep models beside their scenes."""
LONGEST_NAME = 100
"""Characters of a file name that is made from a name inside an input; file systems allow 255 bytes."""


@dataclass(frozen=True, slots=True)
class InputFiles:
    """Files in a folder and below it, never outside.

    Attributes
    ----------
    root
        The folder. Symbolic links are followed before the check.
    """

    root: Path

    def find(self, folder: Path, name: str) -> Path:
        """The file of that name, seen from the folder of the file that names it.

        Raises
        ------
        FileAwayError
            It lies outside of the root, or there is no such file.
        """
        try:
            # Documents from Windows name their files with backslashes.
            path = (folder / name.replace("\\", "/")).resolve()
            inside, there = path.is_relative_to(self.root.resolve()), path.is_file()
        except (OSError, RuntimeError, ValueError):
            inside, there = True, False
        if not inside:
            where = f"The file {name!r} lies outside of {self.root}, where files are read."
            raise FileAwayError(f"{where}{did_you_mean(folder, name)} {self._cure(path)}")
        if not there:
            meant = did_you_mean(folder, name) or " Put it there."
            raise FileAwayError(f"There is no file {name!r} beside the file that names it.{meant}")
        return path

    def _cure(self, path: Path) -> str:
        """Cure for a file outside of the root that does not open all of the disk or home."""
        wider = Path(os.path.commonpath([path.parent, self.root.resolve()]))
        shown = min(os.path.relpath(wider), str(wider), key=len)
        if len(self.root.resolve().relative_to(wider).parts) > FARTHEST_ROOT or wider == Path(wider.anchor):
            return "Copy it beside the file that names it."
        return f"Allow it with --root {shown}, or move the file."

    def read(self, folder: Path, name: str) -> tuple[Path, bytes]:
        """The file and its content; raises FileAwayError as `find` does, and where it may not be read."""
        path = self.find(folder, name)
        try:
            return path, path.read_bytes()
        except OSError as error:
            raise FileAwayError(f"The file {name!r} cannot be read: {error.strerror}.") from error


@dataclass(slots=True)
class SceneFiles:
    """Files that the new scene names. Those inside its folder stay; others are written into it.

    Attributes
    ----------
    folder
        Path of the scene.
    written
        Contents by name of the files to be written.
    """

    folder: Path
    written: dict[str, bytes] = field(default_factory=dict)

    def keep(self, path: Path, content: bytes) -> str:
        """Name of a file that is there, for the scene."""
        folder = self.folder.resolve()
        if path.is_relative_to(folder):
            return path.relative_to(folder).as_posix()
        return self.make(path.stem, path.suffix, content)

    def make(self, stem: str, suffix: str, content: bytes) -> str:
        """Name of a file with a new content, for the scene; no other file of that name is lost."""
        stem = _UNFIT.sub("-", stem).strip(".-")[:LONGEST_NAME] or "file"
        number = 1
        while not self._free(name := f"{stem}{'' if number == 1 else f'-{number}'}{suffix}", content):
            number += 1
        self.written[name] = content
        return name

    def _free(self, name: str, content: bytes) -> bool:
        if name in self.written:
            return self.written[name] == content
        # Some file systems do not distinguish upper and lower case.
        if name.casefold() in map(str.casefold, self.written):
            return False
        path = self.folder / name
        return not path.exists() or (path.is_file() and path.read_bytes() == content)
