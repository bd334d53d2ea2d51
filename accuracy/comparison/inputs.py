"""Pictures to be compared, from files, bytes or arrays: what is in them, and how it was read."""

import hashlib
import io
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from accuracy.comparison.decoding import NotComparableError, Raw, Size, decode
from renderer.images.colors import linear_from_srgb
from renderer.math.arrays import Floats

Encoding = Literal["srgb", "linear"]
SIDECARS = ("error", "samples", "shape")
"""Layers that explain a difference; `penumbra render` saves them beside the picture."""

PACKED = ".npz"
"""Files with a picture, ``image``, and its layers."""

FLOAT_ROUNDING = 2.0**-22
"""Two spacings of float32: by so much a picture may differ between kinds of machines."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A picture as it is compared.

    Attributes
    ----------
    name : str
    linear : (H, W, 3) float64
        Linear RGB, clipped to 0..1 as a display shows it.
    rounding : (H, W, 3) float64
        By how much the file's numbers may have been rounded, linear.
    encoding : {"srgb", "linear"}
        How the file's numbers were read.
    stated : bool
        Whether the user stated it; else it is what its format usually means.
    bits : int
        Of a channel, 32 or 64 for floating point.
    sha256 : str
        Of the file's bytes.
    clipped : int
        Pixels with a channel below 0 or above 1.
    notes : tuple of str
        What was done to read it, in sentences.
    layers : mapping of str to array
        Of `SIDECARS` those that are known.
    """

    name: str
    linear: Floats
    rounding: Floats
    encoding: Encoding
    stated: bool
    bits: int
    sha256: str
    clipped: int
    notes: tuple[str, ...] = ()
    layers: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    @property
    def size(self) -> Size:
        """Width and height in pixels."""
        return self.width, self.height

    @property
    def height(self) -> int:
        """Pixels."""
        return self.linear.shape[0]

    @property
    def width(self) -> int:
        """Pixels."""
        return self.linear.shape[1]


def read_picture(path: str | os.PathLike[str], encoding: Encoding | None = None) -> Picture:
    """The picture of a .png, .npy, .exr or .npz file, with layers that lie beside it as NAME.layer.npy.

    Raises
    ------
    NotComparableError
        If it cannot be read, or holds what is not a colour.
    MissingExtraError
        If it is an .exr file and the library for it is not installed.
    """
    file = Path(path)
    try:
        content = file.read_bytes()
        beside = {name: file.with_name(f"{file.name}.{name}.npy") for name in SIDECARS}
        layers = {name: np.load(there) for name, there in beside.items() if there.exists()}
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise NotComparableError(f"{path}: cannot be read ({reason}).") from error
    if file.suffix.lower() == PACKED:
        content, packed = unpacked(content, file.name)
        layers = packed | layers
    return picture_of(content, file.name, encoding, layers)


def unpacked(content: bytes, name: str) -> tuple[bytes, dict[str, NDArray[Any]]]:
    """The array ``image`` of an .npz file as an .npy file, and its other arrays.

    Raises
    ------
    NotComparableError
        If it is damaged, or has no such array.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as kept:
            arrays = {part: kept[part] for part in kept.files}
    except (OSError, ValueError, EOFError, BadZipFile) as error:
        raise NotComparableError(f"{name} is a damaged NPZ file.") from error
    if "image" not in arrays:
        raise NotComparableError(f"{name} has no array 'image'. Save the picture under this name.")
    pixels = io.BytesIO()
    np.save(pixels, arrays.pop("image"))
    return pixels.getvalue(), arrays


def picture_of(
    content: bytes,
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
        How the numbers mean light. By default ``srgb`` for PNG, ``linear`` for floating point; whole numbers
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
    raw = decode(content, name, size)
    used = encoding or raw.usual
    if used is None:
        raise NotComparableError(
            f"{name} holds whole numbers, whose encoding is unknown. State the encoding, srgb or linear."
        )
    values = _finite(raw, name)
    clipped = int(np.count_nonzero(((values < 0) | (values > 1)).any(axis=2)))
    linear, rounding = _decoded(np.clip(values, 0.0, 1.0), raw, used)
    return Picture(
        name=name,
        linear=linear,
        rounding=rounding,
        encoding=used,
        stated=encoding is not None,
        bits=raw.bits,
        sha256=hashlib.sha256(content).hexdigest(),
        clipped=clipped,
        notes=raw.notes,
        layers=_fitting({**raw.layers, **(layers or {})}, linear.shape, name),
    )


def _finite(raw: Raw, name: str) -> Floats:
    if raw.bits < 32:
        return raw.values
    bad = ~np.isfinite(raw.values).all(axis=2)
    if bad.any():
        y, x = (int(index[0]) for index in np.nonzero(bad))
        raise NotComparableError(
            f"{name}: the pixel in column {x}, row {y} is NaN or infinite ({np.count_nonzero(bad)} such "
            "pixels). A picture with such pixels cannot be compared."
        )
    return raw.values


def _decoded(values: Floats, raw: Raw, encoding: Encoding) -> tuple[Floats, Floats]:
    """Linear values, and how far rounding may have moved each of them."""
    if raw.bits < 32:
        return _from_codes(values, raw.bits, encoding)
    linear = linear_from_srgb(values).astype(np.float64) if encoding == "srgb" else values
    return linear, FLOAT_ROUNDING * linear


def _from_codes(values: Floats, bits: int, encoding: Encoding) -> tuple[Floats, Floats]:
    # A table has as many entries as there are codes, a picture many more pixels.
    largest = 2**bits - 1
    codes = np.arange(largest + 1) / largest
    above = codes + 0.5 / largest
    if encoding == "srgb":
        codes, above = (linear_from_srgb(table).astype(np.float64) for table in (codes, above))
    places = np.rint(values * largest).astype(np.intp)
    return codes.take(places), (above - codes).take(places)


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
