"""Bytes and numbers of a glTF document: buffers, views of them, accessors, pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePosixPath
from typing import TypeVar

import numpy as np

from renderer.math.arrays import Floats
from renderer.meshes.gltf_containers import embedded, file_name, is_embedded
from service.converting.errors import FileAwayError, wrong_at
from service.converting.gltf_document import Accessor, Document, Image
from service.converting.task import Task

Item = TypeVar("Item")

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_ENDINGS = {"image/png": ".png", "image/jpeg": ".jpg", "image/webp": ".webp"}


def pick(name: str, items: Sequence[Item], number: int, pointer: str) -> Item:
    """One item of a list; ConversionError at the place that names one too many."""
    if number >= len(items):
        raise wrong_at(name, pointer, f"There is no number {number}: the document has {len(items)} of them.")
    return items[number]


class Buffers:
    """What the numbers in a document stand for.

    Parameters
    ----------
    task
        The file, from whose folder others are named.
    document
        Its description.
    binary
        The bytes after the description in a GLB; None in other files.
    """

    def __init__(self, task: Task, document: Document, binary: bytes | None) -> None:
        self.task = task
        self.document = document
        self.binary = binary
        self.name = task.notes.file
        self.read: dict[int, bytes] = {}

    def numbers(self, number: int, pointer: str, width: int) -> Floats:
        """Numbers of an accessor, (count, width) float64; normalised integers become 0 to 1, or -1 to 1.

        Raises
        ------
        ConversionError
            At the accessor, where it makes no sense.
        """
        accessor = pick(self.name, self.document.accessors, number, pointer)
        place = f"/accessors/{number}"
        if accessor.sparse is not None or accessor.buffer_view is None:
            raise wrong_at(self.name, place, "Sparse accessors are not read. Save the file without them.")
        if _WIDTHS.get(accessor.type) != width or accessor.component_type not in _COMPONENTS:
            detail = f"Here {width} numbers belong together, and a componentType of {sorted(_COMPONENTS)}."
            raise wrong_at(self.name, place, detail)
        values = self._values(accessor, accessor.buffer_view, width, place).astype(np.float64)
        kind = np.dtype(_COMPONENTS[accessor.component_type])
        if accessor.normalized and kind.kind in "iu":
            values = np.maximum(values / np.iinfo(kind).max, -1.0)
        if not np.isfinite(values).all():
            raise wrong_at(self.name, place, "Some of these numbers are not finite. Save the file again.")
        return values

    def _values(self, accessor: Accessor, view: int, width: int, place: str) -> np.ndarray:
        content = self.view(view, f"{place}/bufferView")
        kind = np.dtype(_COMPONENTS[accessor.component_type])
        stride = self.document.buffer_views[view].byte_stride or kind.itemsize * width
        needed = accessor.byte_offset + (accessor.count - 1) * stride + kind.itemsize * width
        if accessor.count < 1 or needed > len(content) or stride < kind.itemsize * width:
            raise wrong_at(self.name, place, f"Its {accessor.count} items do not fit into its bufferView.")
        return np.ndarray(
            (accessor.count, width), kind, content, accessor.byte_offset, (stride, kind.itemsize)
        )

    def view(self, number: int, pointer: str) -> bytes:
        """Bytes of a bufferView; ConversionError where its buffer is shorter, or is not there."""
        view = pick(self.name, self.document.buffer_views, number, pointer)
        content = self._buffer(view.buffer, f"/bufferViews/{number}/buffer")
        if view.byte_offset + view.byte_length > len(content):
            detail = f"It ends beyond its buffer of {len(content)} bytes: the file is cut short, or damaged."
            raise wrong_at(self.name, f"/bufferViews/{number}", detail)
        return content[view.byte_offset : view.byte_offset + view.byte_length]

    def _buffer(self, number: int, pointer: str) -> bytes:
        buffer = pick(self.name, self.document.buffers, number, pointer)
        if number not in self.read:
            if buffer.uri is not None:
                try:
                    self.read[number] = self._uri(buffer.uri)
                except (FileAwayError, ValueError) as error:
                    raise wrong_at(self.name, f"/buffers/{number}/uri", str(error)) from error
            elif number == 0 and self.binary is not None:
                self.read[number] = self.binary
            else:
                detail = "The buffer has no 'uri', and this is no GLB file that would bring its bytes along."
                raise wrong_at(self.name, f"/buffers/{number}", detail)
        return self.read[number]

    def _uri(self, uri: str) -> bytes:
        return (
            embedded(uri) if is_embedded(uri) else self.task.found.read(self.task.folder, file_name(uri))[1]
        )

    def picture(self, image: Image, number: int) -> tuple[str, str, bytes]:
        """Stem, ending and bytes of a picture.

        Raises
        ------
        ConversionError, FileAwayError, ValueError
            It is not there.
        """
        stem = image.name or f"picture-{number}"
        ending = _ENDINGS.get(image.mime_type or "", ".png")
        if image.buffer_view is not None:
            return stem, ending, self.view(image.buffer_view, f"/images/{number}/bufferView")
        if image.uri is None:
            raise ValueError("The picture has neither 'uri' nor 'bufferView'.")
        if is_embedded(image.uri):
            ending = _ENDINGS.get(image.uri[5:].partition(";")[0], ending)
            return stem, ending, self._uri(image.uri)
        path = PurePosixPath(file_name(image.uri))
        return path.stem, path.suffix, self._uri(image.uri)
