"""Files that a command writes: checked before the work begins, there only when they are whole."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Collection
from pathlib import Path

from service.cli.errors import CommandError

PICTURES = (".png", ".npy", ".exr")


def check_target(path: Path, suffixes: Collection[str]) -> Path:
    """Give the path back if a file of this name can be written there.

    Raises
    ------
    CommandError
        The name has another ending, or its folder is not there or not writable.
    """
    if path.suffix.lower() not in suffixes:
        raise CommandError(f"{path} must end in {' or '.join(suffixes)}. The ending chooses the format.")
    if path.is_dir():
        raise CommandError(f"{path} is a folder. Name a file in it.")
    folder = path.parent
    if not folder.is_dir():
        raise CommandError(f"{folder} is not there. Make the folder first, or write somewhere else.")
    try:
        # Permissions do not tell all: a file system may be full or read-only.
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise CommandError(f"{folder} takes no files ({error.strerror}). Write somewhere else.") from error
    return path


def write_whole(path: Path, content: bytes) -> None:
    """Write a file in one step: whoever looks sees the old file or the new one, never a part.

    Raises
    ------
    CommandError
        The file cannot be written.
    """
    temporary = None
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
            temporary = Path(file.name)
            file.write(content)
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(path)
    except OSError as error:
        raise CommandError(f"{path} cannot be written: {error.strerror or error}.") from error
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def _umask() -> int:
    # The only way to read it is to set it.
    mask = os.umask(0o077)
    os.umask(mask)
    return mask
