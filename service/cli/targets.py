"""Output files: checked before the work begins, and written in one step."""

from __future__ import annotations

import errno
import secrets
import sys
import tempfile
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli import output
from service.cli.errors import CommandError

if TYPE_CHECKING:
    from schemas.api.layers import LayerName

PICTURES = (".png", ".npy", ".exr")
STDOUT = {"-": ".png"} | {f"-{suffix}": suffix for suffix in PICTURES}
"""Names of stdout in place of a file, each with the ending that chooses the format."""


@dataclass(frozen=True, slots=True)
class ImageTarget:
    """Destination of an image, a file or stdout; the suffix chooses the format.

    Attributes
    ----------
    path
        The file; on stdout only its ending counts.
    on_stdout
        Whether there is no file.
    """

    path: Path
    on_stdout: bool = False

    @classmethod
    def named(cls, text: str) -> ImageTarget:
        """The target that an option names; ``./-.npy`` is a file."""
        suffix = STDOUT.get(text.lower())
        return cls(Path(text)) if suffix is None else cls(Path("stdout" + suffix), on_stdout=True)

    def __str__(self) -> str:
        return "stdout" if self.on_stdout else str(self.path)

    @property
    def suffix(self) -> str:
        """The ending, in lower case."""
        return self.path.suffix.lower()

    def check(self, layers: Collection[str] = (), *, as_json: bool) -> None:
        """Raise CommandError, before the work begins, where an image and its layers cannot be written."""
        if not self.on_stdout:
            check_target(self.path, PICTURES)
            for name in layers:
                check_target(_layer_path(self.path, name), (".npy",))
        elif as_json:
            raise CommandError("-o - and --json both need stdout. Name a file with -o.")
        elif layers:
            raise CommandError("--layers are saved beside the picture. Name a file with -o.")
        elif sys.stdout.isatty():
            raise CommandError("stdout is a terminal, and a picture is not text. Pipe it, or name a file.")

    def check_bits(self, bits: int) -> None:
        """Raise CommandError if a file of this kind has no such depth."""
        if bits != 8 and self.suffix != ".png":
            raise CommandError(f"--bits {bits} is for .png. {self} holds linear float32 in any case.")

    def write(self, content: bytes) -> None:
        """Write the image, a file in one step; CommandError if it cannot be written."""
        if self.on_stdout:
            sys.stdout.buffer.write(content)
            sys.stdout.flush()
        else:
            write_whole(self.path, content)


def check_target(path: Path, suffixes: Collection[str]) -> Path:
    """Return the path of a file that can be written.

    Raises
    ------
    CommandError
        The name has another ending, or its folder is not there or not writable.
    """
    if not path.name:
        raise CommandError("The name of the file to write is empty.")
    if path.name.lower() in suffixes:
        raise CommandError(f"{path} is only a file ending. Put a name before it.")
    if path.suffix.lower() not in suffixes:
        raise CommandError(f"{path} must end in {' or '.join(suffixes)}. The ending chooses the format.")
    if path.is_dir():
        raise CommandError(f"{path} is a folder. Name a file in it.")
    folder = path.parent
    if not folder.is_dir():
        raise CommandError(f"The folder {folder} does not exist. Create it first, or write elsewhere.")
    try:
        # Checking permissions is not enough: a file system may be full or read-only.
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        reason = error.strerror or error
        raise CommandError(f"No file can be written in {folder}: {reason}. Write elsewhere.") from error
    return path


def make_folder(folder: Path) -> None:
    """Make a folder, and those above it; CommandError if it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or error
        raise CommandError(f"The folder {folder} cannot be created: {reason}. Name another.") from error


def write_whole(path: Path, content: bytes) -> None:
    """Write a file in one step: readers see the old file or the new one, never a part of it.

    Raises
    ------
    CommandError
        The file cannot be written.
    """
    # Replace the target of a link, not the link.
    path = path.resolve() if path.is_symlink() else path
    # Unlike a file of tempfile this one has the rights of any new file. The name of the target is not part of
    # its name, which might get too long.
    temporary = path.with_name(f".penumbra-{secrets.token_hex(8)}")
    try:
        with temporary.open("xb") as file:
            file.write(content)
        temporary.replace(path)
    except OSError as error:
        raise CommandError(f"{path} cannot be written: {error.strerror or error}.{_cure(error)}") from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def save(path: Path, content: bytes, about: str = "written") -> None:
    """Write a file in one step, and report it."""
    write_whole(path, content)
    output.say(f"{path}: {about}")


def _cure(error: OSError) -> str:
    full = error.errno in {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
    return " Free some space there, or write elsewhere." if full else " Write elsewhere."


def parsed_layers(given: Sequence[str] | None) -> tuple[LayerName, ...]:
    """The layers that an option names, once or repeatedly, with commas or without; each counts once.

    Raises
    ------
    CommandError
        There is no such layer; the message says which one was probably meant.
    """
    from schemas.api.layers import checked_layers

    asked = [name.strip() for names in given or () for name in names.split(",")]
    try:
        return checked_layers(asked)
    except ValueError as error:
        raise CommandError(f"--layers: {error}") from error


def _layer_path(picture: Path, name: str) -> Path:
    from renderer.images.files import layer_path

    return layer_path(picture, name)


def save_layer(out: Path, name: str, content: bytes) -> None:
    """Write the file of a layer, and say where it is."""
    save(_layer_path(out, name), content, name)
