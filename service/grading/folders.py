"""The two folders of grading: no file outside of them is ever opened, not even through a link."""

from __future__ import annotations

import io
import os
import re
import tempfile
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path, PurePosixPath
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison.inputs import SIDECARS
from renderer.assets import FolderAssets
from service.grading.errors import BrokenTestError, GradingError, NotGradableError, NotSubmittedError

MOST_BYTES = 512 * 1024 * 1024
"""Largest file that is opened: a float64 picture of 20 million pixels."""

Role = Literal["submission", "reference"]


@dataclass(frozen=True, slots=True)
class Folder:
    """A folder of the submission or of the manifest.

    Attributes
    ----------
    root : Path
        Resolved.
    role : {"submission", "reference"}
        Decides whether an unusable file is an error of the submission or of the test.
    replaced : mapping of str to bytes
        Contents in place of those of files.
    """

    root: Path
    role: Role
    replaced: Mapping[str, bytes] = field(default_factory=dict)

    def path(self, name: str) -> Path:
        """The resolved path of a file.

        Raises
        ------
        NotSubmittedError
            The submission lacks it.
        NotGradableError, BrokenTestError
            It is not a regular file, too large, or a link leads out of the folder.
        """
        try:
            path = (self.root / name).resolve()
            if not path.is_relative_to(self.root):
                raise self.fault(f"{name} leads out of its folder. Put the file itself there.")
            if not path.exists():
                raise self._missing(name)
            if not path.is_file():
                raise self.fault(f"{name} is not a file. Put a file of this name there.")
            size = path.stat().st_size
        except (OSError, RuntimeError, ValueError) as error:
            # A loop of links, a folder without access, or an invalid file name.
            raise self.fault(f"{name} cannot be opened.") from error
        if size > MOST_BYTES:
            raise self.fault(f"{name} has {size} bytes; at most {MOST_BYTES} are read.")
        return path

    def read(self, name: str) -> bytes:
        """The content of a file.

        Raises
        ------
        GradingError
            The path is invalid, as in `path`, or the file cannot be read.
        """
        path = self.path(name)
        try:
            return self.replaced[name] if name in self.replaced else path.read_bytes()
        except OSError as error:
            raise self.fault(f"{name} cannot be read ({error.strerror}).") from error

    def assets(self, name: str) -> FolderAssets:
        """Textures and meshes of a scene, in its folder or below."""
        return FolderAssets(self.path(name).parent)

    def layers(self, name: str) -> dict[str, NDArray[Any]]:
        """Layers that `penumbra render` saved beside a picture.

        Raises
        ------
        GradingError
            One of them is not an array file.
        """
        beside = {layer: f"{name}.{layer}.npy" for layer in SIDECARS}
        there = {layer: file for layer, file in beside.items() if (self.root / file).exists()}
        try:
            return {
                layer: np.load(io.BytesIO(self.read(file)), allow_pickle=False)
                for layer, file in there.items()
            }
        except (ValueError, EOFError) as error:
            raise self.fault(f"A layer beside {name} is damaged: {error}") from error

    def fault(self, message: str) -> GradingError:
        """The error for an unusable file of this folder."""
        return NotGradableError(message) if self.role == "submission" else BrokenTestError(message)

    def _missing(self, name: str) -> GradingError:
        if self.role == "submission":
            meant = similar(self.root, name)
            found = f" Found {meant}, wanted {name}: hand it in under this name." if meant else ""
            return NotSubmittedError(f"{name} was not submitted.{found}")
        return BrokenTestError(f"{name} is not beside the manifest.")


def keep(file: Path, content: bytes) -> None:
    """Write a file of a cache: processes may write the same one, and renaming leaves a complete file."""
    with tempfile.NamedTemporaryFile(dir=file.parent, delete=False) as whole:
        whole.write(content)
    Path(whole.name).replace(file)


MOST_FILES = 10_000
"""Files of a submission among which a similar name is looked for; folders of packages have any number."""

COPY = re.compile(r"\(\d+\)(?=(\.[^.]*)?$)")
"""Suffix of a second download in browsers: p (1).png."""

LEFT_OUT = "__MACOSX"
"""A folder with which macOS doubles the names of an archive."""


def readable(name: str) -> str:
    r"""A name of a file as text that every document can hold: bytes that are not UTF-8 are escaped.

    Backslashes are doubled, so that different names have different texts.

    >>> print(readable("zo\udceb"), readable(r"zo\xeb"))
    zo\xeb zo\\xeb
    """
    return os.fsencode(name.replace("\\", "\\\\")).decode("utf-8", "backslashreplace")


def similar(root: Path, wanted: str) -> str | None:
    """The file that was probably meant by a name, relative to the folder; None if there is none.

    Names are similar if they differ in capitals, blanks, the form of accents, the number that a browser adds,
    or the folder. Links are not followed.
    """
    goal = _core(PurePosixPath(wanted).name)
    found = [path for path in islice(_files(root), MOST_FILES) if _core(path.name) == goal]
    nearest = min(found, key=lambda path: (len(path.parts), path.as_posix()), default=None)
    return None if nearest is None else readable(nearest.as_posix())


def _core(name: str) -> str:
    """Key that similar names share."""
    words = unicodedata.normalize("NFKC", name).casefold()
    return "".join(COPY.sub("", words).split())


def _files(root: Path) -> Iterator[PurePosixPath]:
    for folder, folders, files in os.walk(root):
        folders[:] = sorted(name for name in folders if not is_hidden(name))
        inside = PurePosixPath(folder).relative_to(root)
        yield from (inside / name for name in sorted(files) if not is_hidden(name))


def is_hidden(name: str) -> bool:
    """Whether people do not see a file or folder of this name."""
    return name.startswith(".") or name == LEFT_OUT
