"""Pictures as files: of which kind, and there only when they are whole."""

from __future__ import annotations

import errno
import os
import secrets
from pathlib import Path

from service.client.pictures import PictureKind

KINDS: dict[str, PictureKind] = {".png": "png", ".npy": "npy", ".exr": "exr"}


def kind_of(path: str | os.PathLike[str]) -> PictureKind:
    """The kind of picture that a file of this name holds.

    Raises
    ------
    ValueError
        The name has another ending.
    """
    kind = KINDS.get(Path(path).suffix.lower())
    if kind is None:
        raise ValueError(f"{os.fspath(path)} must end in {', '.join(KINDS)}: the ending chooses the format.")
    return kind


def write(path: str | os.PathLike[str], content: bytes) -> Path:
    """Write a file in one step: whoever looks sees the old file or the new one, never a part.

    Raises
    ------
    OSError
        It cannot be written; FileNotFoundError names the folder that is missing.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "There is no such folder", str(target.parent))
    # Unlike a file of tempfile this one has the rights that the process gives to new files.
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    try:
        with temporary.open("xb") as file:
            file.write(content)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
    return target
