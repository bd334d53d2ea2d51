"""Names of files that people choose: as readable words, and the file that was probably meant by a name."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Iterator
from itertools import islice
from pathlib import Path, PurePosixPath

MOST_FILES = 10_000
"""Files of a submission among which a similar name is looked for; folders of packages have any number."""

COPY = re.compile(r"\(\d+\)(?=(\.[^.]*)?$)")
"""What browsers add to the name of a second download: p (1).png."""

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
    """What similar names have in common."""
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
