"""Pictures to compare, from files, bytes or arrays."""

import hashlib
import os
import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import BadZipFile, ZipFile, ZipInfo

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison.decoding import (
    DAMAGE_ERRORS,
    HEADER_BYTES,
    Content,
    NotComparableError,
    Size,
    array_of,
    decode,
)
from accuracy.comparison.pixels import Encoding, Pixels, bands
from renderer.math.arrays import Floats
from schemas.limits import how_to_raise, limits_in_force

SIDECARS = ("error", "samples", "shape")
"""Layers that explain a difference; `penumbra render` saves them beside the picture."""

PACKED, IMAGE = ".npz", "image"
"""Files with a picture of this name, and its layers."""

PIXEL_BYTES = 32
"""Most bytes of a pixel in an array of such a file: four numbers of 64 bits."""

BYTES_AT_ONCE = 1 << 20
"""Bytes decompressed at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A picture as it is compared.

    Attributes
    ----------
    name : str
    pixels : Pixels
    encoding : {"srgb", "linear"}
        Encoding by which the file's numbers were read.
    stated : bool
        Whether the user stated it; otherwise it is the usual one of the format.
    bits : int
        Of a channel, 32 or 64 for floating point.
    sha256 : str
        Of the file's bytes.
    clipped : int
        Pixels with a channel below 0 or above 1.
    notes : tuple of str
        Sentences about how it was read.
    layers : mapping of str to array
        Of `SIDECARS` those that are known.
    """

    name: str
    pixels: Pixels
    encoding: Encoding
    stated: bool
    bits: int
    sha256: str
    clipped: int
    notes: tuple[str, ...] = ()
    layers: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    @classmethod
    def of_values(cls, linear: Floats, rounding: Floats | None = None) -> "Picture":
        """A picture of linear values (H, W, 3) float64 without a file."""
        return cls("", Pixels(linear, "linear", rounding), "linear", True, 64, "", 0)

    @property
    def size(self) -> Size:
        """Width and height in pixels."""
        return self.width, self.height

    @property
    def height(self) -> int:
        """Pixels."""
        return self.pixels.shape[0]

    @property
    def width(self) -> int:
        """Pixels."""
        return self.pixels.shape[1]

    @property
    def linear(self) -> Floats:
        """Linear RGB (H, W, 3), clipped to 0..1 as a display shows it."""
        return self.pixels.linear

    @property
    def rounding(self) -> Floats:
        """Bound on the rounding of the file's numbers, linear, (H, W, 3)."""
        return self.pixels.rounding

    def with_values(self, linear: Floats, rounding: Floats) -> "Picture":
        """The picture with other linear values and roundings, (H, W, 3) float64."""
        return replace(self, pixels=Pixels(linear, "linear", rounding))

    def part(self, *slices: slice) -> "Picture":
        """A part of the picture, with its layers."""
        layers = {name: layer[slices] for name, layer in self.layers.items()}
        return replace(self, pixels=self.pixels.part(*slices), layers=layers)

    def bands(self) -> Iterator["Picture"]:
        """The picture in bands of rows, without cutting blocks."""
        return (self.part(slice(*rows)) for rows in bands(self.height, self.width))


def read_picture(
    path: str | os.PathLike[str], encoding: Encoding | None = None, size: Size | None = None
) -> Picture:
    """The picture of a .png, .npy, .exr or .npz file, with layers that lie beside it as NAME.layer.npy.

    `encoding` and `size` are those of `picture_of`.

    Raises
    ------
    NotComparableError
        If it cannot be read, has values that are no colours, or has another size.
    MissingExtraError
        If it is an .exr file and the library for it is not installed.
    """
    file = Path(path)
    try:
        packed = dict[str, NDArray[Any]]()
        if file.suffix.lower() == PACKED:
            with file.open("rb") as archive:
                content, packed = unpacked(archive, file.name)
        else:
            content = file.read_bytes()
        beside = {name: file.with_name(f"{file.name}.{name}.npy") for name in SIDECARS}
        layers = packed | {name: np.load(there) for name, there in beside.items() if there.exists()}
    except NotComparableError:
        raise
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise NotComparableError(f"{path}: cannot be read ({reason}).") from error
    return picture_of(content, file.name, encoding, layers, size)


def unpacked(archive: BinaryIO, name: str) -> tuple[Content, dict[str, NDArray[Any]]]:
    """The array ``image`` of an .npz file as an .npy file, and its other arrays.

    Raises
    ------
    NotComparableError
        If it is damaged, or has no such array.
    """
    try:
        with ZipFile(archive) as kept:
            files = {layer: f"{layer}.npy" for layer in (IMAGE, *SIDECARS)}
            found = {layer: kept.getinfo(file) for layer, file in files.items() if file in kept.namelist()}
            _refuse_large(found.values(), name)
            parts = {layer: _read_in_pieces(kept, file) for layer, file in found.items()}
        layers = {layer: array_of(part) for layer, part in parts.items() if layer != IMAGE}
    except NotComparableError:
        raise
    except (*DAMAGE_ERRORS, BadZipFile, NotImplementedError, RuntimeError, zlib.error) as error:
        raise NotComparableError(f"{name} is a damaged NPZ file.") from error
    if IMAGE not in parts:
        raise NotComparableError(f"{name} has no array '{IMAGE}'. Save the picture under this name.")
    return parts[IMAGE], layers


def _read_in_pieces(archive: ZipFile, file: ZipInfo) -> bytearray:
    """A file of an archive, in memory once: `ZipFile.read` holds it twice."""
    content = bytearray()
    with archive.open(file) as packed:
        for piece in iter(partial(packed.read, BYTES_AT_ONCE), b""):
            content += piece
    return content


def _refuse_large(parts: Iterable[ZipInfo], name: str) -> None:
    """Refuse arrays too large for any accepted picture, before they are unpacked."""
    most = limits_in_force().max_image_pixels
    if any(part.file_size > PIXEL_BYTES * most + HEADER_BYTES for part in parts):
        raise NotComparableError(
            f"{name} has more than {most} pixels. Compare parts of it. {how_to_raise('max_image_pixels')}"
        )


def picture_of(
    content: Content,
    name: str,
    encoding: Encoding | None = None,
    layers: Mapping[str, NDArray[Any]] | None = None,
    size: Size | None = None,
) -> Picture:
    """The picture in the bytes of a PNG, NPY or EXR file.

    Parameters
    ----------
    content
        Its kind follows from its first bytes, not from its name.
    name
        For messages.
    encoding
        Encoding of the numbers. By default ``srgb`` for PNG, ``linear`` for floating point; whole numbers
        in an NPY file have no default.
    layers
        ``error``, ``samples`` and ``shape`` of the picture, (H, W) or (H, W, 3), in place of the file's own.
    size
        Width and height that it must have. A file of another size is refused before it is decoded.

    Raises
    ------
    NotComparableError
        If it cannot be read, holds what is not a colour, or has another size.
    """
    raw = decode(content, name, SIDECARS, size)
    used = encoding or raw.usual
    if used is None:
        raise NotComparableError(
            f"{name} holds whole numbers, whose encoding is unknown. State the encoding, srgb or linear."
        )
    return Picture(
        name=name,
        pixels=Pixels(raw.values, used),
        encoding=used,
        stated=encoding is not None,
        bits=raw.bits,
        sha256=hashlib.sha256(content).hexdigest(),
        clipped=_clipped(raw.values, name),
        notes=raw.notes,
        layers=_fitting({**raw.layers, **(layers or {})}, raw.values.shape, name),
    )


def _clipped(values: NDArray[Any], name: str) -> int:
    """Pixels with a channel below 0 or above 1, all of them finite."""
    if values.dtype.kind != "f":
        return 0
    parts = [values[first:last] for first, last in bands(*values.shape[:2])]
    bad = np.concatenate([~np.isfinite(part).all(axis=2) for part in parts])
    if bad.any():
        y, x = (int(index[0]) for index in np.nonzero(bad))
        raise NotComparableError(
            f"{name}: the pixel in column {x}, row {y} is NaN or infinite ({np.count_nonzero(bad)} such "
            "pixels). A picture with such pixels cannot be compared."
        )
    return sum(int(np.count_nonzero(((part < 0) | (part > 1)).any(axis=2))) for part in parts)


def _fitting(
    layers: Mapping[str, NDArray[Any]], shape: tuple[int, ...], name: str
) -> dict[str, NDArray[Any]]:
    kept = {layer: values for layer, values in layers.items() if layer in SIDECARS}
    for layer, values in kept.items():
        wanted = shape if layer == "error" else shape[:2]
        if values.shape != wanted:
            raise NotComparableError(
                f"{name}: its layer '{layer}' has the shape {values.shape}, and must have {wanted}. "
                "Save picture and layers of the same render."
            )
    return kept
