"""Uploaded textures and meshes, kept by the SHA-256 of their bytes."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import AsyncIterator, Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import IO

import numpy as np
from anyio import to_thread
from numpy.lib.format import MAGIC_PREFIX
from PIL import Image

from renderer.assets import AssetError, NoSuchAssetError, too_many_pixels
from renderer.images.reading import (
    FORMATS,
    FORMATS_OF_PILLOW,
    image_size,
    media_type_beside_pillow,
    upright_size,
)
from renderer.meshes.files import announced, file_kind, needs_other_files
from schemas.limits import Limits
from schemas.reading.file_kinds import recognise
from service.errors import StoreDamagedError, UnknownAssetError, UploadMismatchError, UploadUnusableError
from service.storage.checking import checked
from service.storage.checksums import is_whole, read_checked
from service.storage.objects import Objects, Stored

PREFIX = "sha256:"
_MESHES = {
    "glb": "model/gltf-binary",
    "gltf": "model/gltf+json",
    "obj": "model/obj",
    "ply": "application/x-ply",
}
_ARRAY = "application/x-npy"
_SCANNED_BYTES = 1 << 16
DAMAGED = ".damaged"
"""Ends the name of an asset whose bytes have another hash than its name."""


class Kind(StrEnum):
    """The kinds of assets: a picture that a texture may name, a mesh, and an array that is only compared."""

    PICTURE = "picture"
    MESH = "mesh"
    ARRAY = "array"


@dataclass(frozen=True)
class Header:
    """Metadata from the first bytes of a file; a mesh has neither width nor height."""

    media_type: str
    width: int
    height: int


class AssetStore:
    """One object for each asset. Satisfies ``renderer.AssetSource``.

    Parameters
    ----------
    objects : Objects
        The store of the files.
    limits : Limits
        Larger ones are refused before they are decoded: a few kilobytes can unpack to gigabytes.
    """

    def __init__(self, objects: Objects, limits: Limits) -> None:
        self._objects = objects
        self.limits = limits
        self._inspecting = threading.Lock()
        objects.begin("")

    def find(self, sha256: str, size: int | None = None) -> Stored | None:
        """Find an asset, of this size if one is given; None if there is none.

        Its reads raise UnknownAssetError if its bytes have another hash: then it is set aside.
        """
        stored = self._objects.find(sha256)
        if stored is None:
            return None
        if size not in (None, stored.size):
            self._set_aside(sha256)
            return None
        return replace(stored, read=partial(self._read, sha256, checked(sha256, stored, sha256)))

    def _read(self, sha256: str, stored: Stored, begin: int, end: int) -> bytes:
        try:
            return stored.read(begin, end)
        except StoreDamagedError as error:
            self._set_aside(sha256)
            raise UnknownAssetError from error

    def _set_aside(self, sha256: str) -> None:
        """Give a damaged asset another name, so that it counts as missing and is uploaded again."""
        # An asset that the disk cannot read is set aside; after any other error, which may pass, it stays.
        with suppress(StoreDamagedError, FileNotFoundError):
            content = self._objects.get(sha256)
            if is_whole(content, sha256):
                return
            self._objects.put(f"{sha256}{DAMAGED}", content)
        self._objects.delete([sha256])

    def read(self, name: str) -> bytes:
        """Return the bytes of the asset that a scene names ``sha256:<hex>``.

        Raises
        ------
        KeyError
            If there is none, or its bytes have another hash: then it is set aside.
        """
        sha256 = name.removeprefix(PREFIX)
        if name == sha256 or not is_sha256(sha256):
            raise KeyError(name)
        try:
            return read_checked(
                sha256, lambda: self._objects.get(sha256), lambda content: is_whole(content, sha256)
            )
        except FileNotFoundError:
            raise KeyError(name) from None
        except StoreDamagedError:
            self._set_aside(sha256)
            raise NoSuchAssetError("The stored file is damaged. Upload it again.") from None

    async def receive(self, sha256: str, chunks: AsyncIterator[bytes]) -> tuple[int, Header]:
        """Keep a body as it arrives, and return its size and what kind of file it is.

        Raises
        ------
        UploadMismatchError
            If the bytes have another hash; nothing is kept.
        UploadUnusableError
            If they are neither picture nor mesh, or announce too many pixels or triangles; nothing is kept.
        """
        digest, size = hashlib.sha256(), 0
        with self._objects.draft(sha256) as file:
            async for chunk in chunks:
                digest.update(chunk)
                size += len(chunk)
                await to_thread.run_sync(file.write, chunk)
            if digest.hexdigest() != sha256:
                raise UploadMismatchError("The body does not have the SHA-256 that is in the address.")
            file.flush()
            header = await to_thread.run_sync(self._inspect, file)
            await to_thread.run_sync(partial(self._objects.keep, file, sha256, durable=True))
        return size, header

    def drop(self, hashes: Iterable[str], before: datetime) -> None:
        """Remove assets, except those that were sent since."""
        self._objects.delete(sha256 for sha256 in hashes if self._is_older(sha256, before))

    def _is_older(self, sha256: str, before: datetime) -> bool:
        stored = self._objects.find(sha256)
        return stored is not None and (stored.modified or 0.0) < before.timestamp()

    def sweep(self, known: set[str], before: datetime, age_seconds: float) -> None:
        """Remove what a killed process left behind: parts of files, and files without a row.

        Damaged assets that were set aside go, too.

        Parameters
        ----------
        known : set of str
            All assets in the database.
        before : datetime
            Those that were sent later stay.
        age_seconds : float
            Parts of files that are younger stay.
        """
        self._objects.tidy(age_seconds)
        self._objects.delete(
            found.name
            for found in self._objects.found()
            if is_sha256(found.name.removesuffix(DAMAGED))
            and found.name not in known
            and found.modified < before.timestamp()
        )

    def _inspect(self, file: IO[bytes]) -> Header:
        # One at a time: a mesh is read wholly, and its description takes several times its length.
        with self._inspecting:
            header = read_header(Path(file.name), self.limits)
        most = self.limits.max_image_pixels
        if header.width * header.height > most:
            raise UploadUnusableError(too_many_pixels(most, f"{header.width} x {header.height} pixels, "))
        return header


def read_header(path: Path, limits: Limits) -> Header:
    """Read the type of a file, and a picture's size, without decoding it.

    Raises
    ------
    UploadUnusableError
        If it is neither a picture nor a mesh, or a mesh of too many triangles.
    """
    with path.open("rb") as file:
        beginning = file.read(_SCANNED_BYTES)
    if beginning.startswith(MAGIC_PREFIX):
        return _array_header(path)
    kind = _mesh_kind(beginning)
    return _mesh_header(path, kind, limits) if kind else _image_header(path, limits)


def _array_header(path: Path) -> Header:
    try:
        # Nothing but its head is read.
        shape = np.load(path, mmap_mode="r", allow_pickle=False).shape
    except (OSError, ValueError, EOFError) as error:
        raise UploadUnusableError("This NPY file is damaged, or has objects in it.") from error
    if len(shape) != len("HWC") or 0 in shape:
        raise UploadUnusableError("An NPY file of a picture has the shape (height, width, channels).")
    return Header(_ARRAY, shape[1], shape[0])


def _mesh_kind(beginning: bytes) -> str | None:
    try:
        return file_kind(beginning)
    except AssetError:
        return None


def _mesh_header(path: Path, kind: str, limits: Limits) -> Header:
    try:
        content = path.read_bytes()
        announced(content, limits.max_mesh_triangles)
        if needs_other_files(content, limits.max_mesh_triangles):
            raise UploadUnusableError(
                "This glTF file has its buffers in other files, and an upload is one file. Save it as GLB, "
                "or submit the scene with 'penumbra submit' or the Python client, which put them together."
            )
    except AssetError as error:
        raise UploadUnusableError(str(error)) from error
    return Header(_MESHES[kind], 0, 0)


def _image_header(path: Path, limits: Limits) -> Header:
    with path.open("rb") as file:
        media_type = media_type_beside_pillow(file.read(_SCANNED_BYTES))
    try:
        if media_type is not None:
            return Header(media_type, *image_size(path.read_bytes(), limits.max_image_pixels))
        # Pillow reads no more than the header.
        with Image.open(path, formats=FORMATS_OF_PILLOW) as image:
            return Header(Image.MIME[image.format or ""], *upright_size(image))
    except AssetError as error:
        raise UploadUnusableError(str(error)) from error
    except Image.DecompressionBombError as error:
        raise UploadUnusableError(too_many_pixels(limits.max_image_pixels)) from error
    except (OSError, ValueError, SyntaxError) as error:
        raise UploadUnusableError(
            f"{_given(path)} neither a picture nor a mesh. Send one of {', '.join(FORMATS)}, OBJ, PLY, GLB."
        ) from error


def _given(path: Path) -> str:
    with path.open("rb") as file:
        kind = recognise(file.read(_SCANNED_BYTES))
    return f"This is {kind.phrase}," if kind and kind.group not in {"picture", "mesh"} else "The body is"


def kind_of(media_type: str) -> Kind:
    """Return what an asset is by its media type."""
    if media_type == _ARRAY:
        return Kind.ARRAY
    return Kind.MESH if media_type in _MESHES.values() else Kind.PICTURE


def is_sha256(text: str) -> bool:
    """Whether a text is 64 lower-case hexadecimal digits.

    >>> is_sha256("ab" * 32), is_sha256("../passwd")
    (True, False)
    """
    return len(text) == 64 and set(text) <= set("0123456789abcdef")
