"""Files that a scene names: where they come from, and how large they may be."""

import errno
import os
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from renderer.similar_files import did_you_mean
from schemas.limits import Limits, how_to_raise, limits_in_force

PILLOW_PIXELS = 178_956_970
"""Pillow's own limit, which holds in any case: twice its `Image.MAX_IMAGE_PIXELS`."""


class AssetError(ValueError):
    """A file that a scene names cannot be read or used.

    Parameters
    ----------
    message : str
        For the author of the scene.
    pointer : str, optional
        The place in the scene that names the file, where it is known.
    """

    def __init__(self, message: str, pointer: str = "") -> None:
        super().__init__(message)
        self.pointer = pointer


class AssetSource(Protocol):
    """Source of the content of named files."""

    def read(self, name: str) -> bytes:
        """Content of a file; raises KeyError if there is none of that name."""
        ...


class NoSuchAssetError(KeyError):
    """A source has no file of a name; the text says why and what to do."""

    def __str__(self) -> str:
        return str(self.args[0])


class NoAssets:
    """The source of a scene without files."""

    def read(self, name: str) -> bytes:
        """Raise NoSuchAssetError: there are no files."""
        raise NoSuchAssetError(
            f"This scene has no folder, so there is no file {name!r}. Give one as 'assets'."
        )


class FolderAssets:
    """Files in a folder and below it, never outside.

    Parameters
    ----------
    folder : Path
        Symbolic links are followed before the check.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()

    def read(self, name: str) -> bytes:
        """Content of the file; NoSuchAssetError if it is missing, no plain file, or outside the folder."""
        try:
            path = (self.folder / name).resolve()
            if not path.is_relative_to(self.folder):
                raise NoSuchAssetError(_outside(name) + did_you_mean(self.folder, name))
            if path.is_file():
                return path.read_bytes()
            raise NoSuchAssetError(_not_a_file(self.folder, name, path))
        except PermissionError as error:
            raise NoSuchAssetError("This file cannot be read. Change its permissions.") from error
        except (OSError, RuntimeError, ValueError) as error:
            # A loop of links, a name too long or one that no file can have.
            raise NoSuchAssetError(NOT_THERE) from error


MISSING = "There is no such file. Upload it first and name it by its sha256."
"""Message for documents without a folder."""
NOT_THERE = "There is no such file. Name one in the scene's folder or below it."
_INSIDE = "Files are read only in the scene's folder and below it: copy this one there."


def _outside(name: str) -> str:
    if Path(name).is_absolute():
        return f"This absolute path leads outside the scene's folder. {_INSIDE}"
    if os.path.normpath(name).startswith(os.pardir):
        return f"This path leads outside the scene's folder by '..'. {_INSIDE}"
    return f"A symbolic link on this path leads outside the scene's folder. {_INSIDE}"


def _not_a_file(folder: Path, name: str, path: Path) -> str:
    if path.is_dir():
        return "This is a folder. Name a file in it."
    if "://" in name:
        return "Nothing is fetched from an address. Download the file into the scene's folder and name it."
    if name.startswith("sha256:"):
        return "This names an uploaded file, and here files are read. Name the file in the scene's folder."
    meant = did_you_mean(folder, name)
    missing = f"There is no such file.{meant}" if meant else NOT_THERE
    return f"{missing} Folders are separated by '/', not by '\\'." if "\\" in name else missing


def content_of(name: str, assets: AssetSource) -> bytes:
    """Content of a file that a scene names.

    Raises
    ------
    AssetError
        If there is none of that name.
    """
    try:
        return assets.read(name)
    except NoSuchAssetError as error:
        raise AssetError(str(error)) from None
    except KeyError:
        raise AssetError(MISSING) from None


@dataclass(frozen=True, slots=True)
class LimitedAssets:
    """Files of a source, with limits of their own on how large they may be."""

    source: AssetSource
    limits: Limits

    def read(self, name: str) -> bytes:
        """Content of a file of the source; raises KeyError if there is none of that name."""
        return self.source.read(name)


def limits_of(assets: AssetSource) -> Limits:
    """The limits of a source's files: its own `limits` if it has some, else those of this process."""
    own = getattr(assets, "limits", None)
    return own if isinstance(own, Limits) else limits_in_force()


def asset_source(assets: AssetSource | str | os.PathLike[str]) -> AssetSource:
    """Give the source of a scene's files: the files of a folder, or a source as it is.

    Raises
    ------
    NotADirectoryError
        The path is not that of a folder.
    TypeError
        It is neither a path nor a source.
    """
    if isinstance(assets, str | os.PathLike):
        folder = Path(assets)
        if not folder.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, "This is no folder of a scene's files", str(folder))
        return FolderAssets(folder)
    if not callable(getattr(assets, "read", None)):
        kind = type(assets).__name__
        raise TypeError(f"'assets' must be a folder or have a method read(name); {kind} has none.")
    return assets


# Reentrant: a reader of meshes may decode the pictures that they name.
_filters_lock = threading.RLock()


@contextmanager
def changed_filters() -> Iterator[None]:
    """Restore the warning filters at the end, as `warnings.catch_warnings` does for one thread alone.

    Filters belong to the process: two threads in `catch_warnings` would restore each other's, for good.
    """
    with _filters_lock, warnings.catch_warnings():
        yield


def too_many_pixels(most: int, size: str = "") -> str:
    """The message for a picture of more pixels than `most`, or than Pillow opens; `size` is their number."""
    if most >= PILLOW_PIXELS:
        return f"The picture has {size}more than the {PILLOW_PIXELS} that Pillow opens. Make it smaller."
    cure = f"Make it smaller. {how_to_raise('max_image_pixels')}"
    return f"The picture has {size}more than the {most} allowed. {cure}"
