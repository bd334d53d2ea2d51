"""Reader of OpenEXR files of any program: chooses the channels of the picture, and places its data window."""

import io
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.assets import too_many_pixels
from renderer.errors import ImageFileError
from renderer.images.exr import RGB, channels_of, require_exr
from renderer.layers import LAYERS, Layers
from schemas.limits import limits_in_force

SIGNATURE = b"\x76\x2f\x31\x01"

PIXEL_BYTES = 64
"""Bytes of all channels of all parts of a file, per allowed pixel."""

BAND_ROWS = 256
"""Rows that are decoded at once: whole blocks of every compression, and whole tiles of the usual sizes."""

KINDS = (np.int32, np.float16, np.float32)
"""Types of channels by EXR's number. Its whole numbers have no sign; those of layers have."""

UNREADABLE = "This is not an EXR file that can be read."

Window = tuple[int, int, int, int]
"""First column and row, and those after the last."""

Planes = Mapping[str, NDArray[Any]]


@dataclass(frozen=True, slots=True, eq=False)
class ExrPicture:
    """Contents of an EXR file.

    Attributes
    ----------
    image : (H, W, 3) float32
        Of the size of the display window; missing pixels are black.
    alpha : (H, W) float32 or None
        None if there is none; 0 where no pixel is stored.
    layers : mapping of str to array
        Layers of the file, of the size of the picture.
    grey : bool
        Whether it has one channel, which was taken for all three.
    notes : tuple of str
        Sentences about the picture that was chosen, and where its pixels lie.
    """

    image: NDArray[np.float32]
    alpha: NDArray[np.float32] | None
    layers: Layers
    grey: bool
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Part:
    """Header of a part.

    Attributes
    ----------
    name : str
        May be empty.
    channels : mapping of str to bool
        Whether each has a number for every pixel.
    data, display : Window
    deep : bool
        Whether a pixel may have several numbers of each channel.
    """

    name: str
    channels: Mapping[str, bool]
    data: Window
    display: Window
    deep: bool

    @property
    def full(self) -> set[str]:
        """Names of the channels that have a number for every pixel."""
        return {name for name, is_full in self.channels.items() if is_full and not self.deep}

    @property
    def shared(self) -> Window:
        """Pixels of both windows, which may be none."""
        (a, b, c, d), (left, top, right, bottom) = self.data, self.display
        left, top = max(a, left), max(b, top)
        return left, top, max(left, min(c, right)), max(top, min(d, bottom))


@dataclass(frozen=True, slots=True)
class _Source:
    """The channels of a file that are the picture.

    Attributes
    ----------
    number : int
        Of the part, from 0.
    part : _Part
    prefix : str
        Of the channels: the layer's name and a point, or nothing.
    colors : tuple of str
        Three channels without the prefix; grey has the same one three times.
    """

    number: int
    part: _Part
    prefix: str
    colors: tuple[str, ...]

    @property
    def channels(self) -> list[str]:
        """Names of the colours' channels."""
        return [self.prefix + color for color in self.colors]

    @property
    def alpha(self) -> str | None:
        """Name of the alpha channel; None if there is none."""
        name = f"{self.prefix}A"
        return name if name in self.part.full else None


def size_of_exr(content: bytes) -> tuple[int, int]:
    """Width and height of the picture in an EXR file, from its headers.

    Raises
    ------
    MissingExtraError
        If OpenEXR is not installed.
    ImageFileError
        If the content is not an EXR file, or has no colours.
    """
    left, top, right, bottom = _source(_parts(content)).part.display
    return right - left, bottom - top


def decode_exr(content: bytes) -> tuple[NDArray[np.float32], Layers]:
    """The image (H, W, 3) and the layers of an EXR file; raises as `read_exr` does."""
    found = read_exr(content)
    return found.image, found.layers


def read_exr(content: bytes, max_pixels: int | None = None, layers: Collection[str] = LAYERS) -> ExrPicture:
    """The picture of an EXR file, whichever program wrote it.

    It is that of the first part with channels R, G and B, else of the first with Y (grey), else of the first
    layer with colours, before others one that is called Combined. Other channels are ignored, but those of
    `layers`.

    Raises
    ------
    MissingExtraError
        If OpenEXR is not installed.
    ImageFileError
        If the content is not an EXR file, has no colours, or more than `max_pixels` pixels, by default those
        of the limits in force.
    """
    most = limits_in_force().max_image_pixels if max_pixels is None else max_pixels
    parts = _parts(content)
    source = _source(parts)
    _check_size(parts, source.part, most)
    left, top, right, bottom = source.part.display
    size = bottom - top, right - left
    image = np.zeros((*size, 3), np.float32)
    targets = [(name, image[..., i]) for i, name in enumerate(source.channels)]
    alpha = None if source.alpha is None else np.zeros(size, np.float32)
    if source.alpha is not None and alpha is not None:
        targets.append((source.alpha, alpha))
    sheets = {}
    for layer in LAYERS.values():
        names = channels_of(layer)
        if layer.name in layers and source.part.full.issuperset(names):
            sheets[layer.name] = layer.blank(*size)
            planes = np.moveaxis(sheets[layer.name].reshape(*size, -1), -1, 0)
            targets += zip(names, planes, strict=True)
    _fill(targets, content, source, len(parts))
    notes = *_chosen(source, len(parts)), *_placed(source.part)
    return ExrPicture(image, alpha, sheets, len(set(source.colors)) == 1, notes)


def _parts(content: bytes) -> list[_Part]:
    exr = require_exr()
    try:
        file = exr.File(io.BytesIO(content), separate_channels=True, header_only=True, num_threads=0)
        return [_part(str(part.name() or ""), file.header(number)) for number, part in enumerate(file.parts)]
    except (RuntimeError, ValueError, TypeError, KeyError) as error:
        raise ImageFileError(UNREADABLE) from error


def _part(name: str, header: Mapping[str, Any]) -> _Part:
    channels = {channel.name: channel.xSampling == channel.ySampling == 1 for channel in header["channels"]}
    windows = _window(header["dataWindow"]), _window(header["displayWindow"])
    return _Part(name, channels, *windows, deep="deep" in str(header.get("type", "")))


def _window(box: Any) -> Window:
    (left, top), (right, bottom) = ((int(x), int(y)) for x, y in box)
    return left, top, right + 1, bottom + 1


def _fill(targets: Sequence[tuple[str, NDArray[Any]]], content: bytes, source: _Source, parts: int) -> None:
    """Copy channels into arrays of the display window; grey is copied three times."""
    names = sorted({name for name, _ in targets})
    (x, y), (left, top, right, bottom) = source.part.display[:2], source.part.shared
    columns = slice(left - source.part.data[0], right - source.part.data[0])
    for first, planes in _bands(content, source, names, parts):
        if any(planes[name].dtype.kind != "f" for name in source.channels):
            raise ImageFileError(
                f"This EXR file stores whole numbers in {', '.join(source.channels)}, and colours are "
                "floating-point numbers. Save it with half or float channels."
            )
        begin, end = max(first, top), min(first + len(planes[names[0]]), bottom)
        if begin < end:
            for name, target in targets:
                rows = planes[name][begin - first : end - first, columns]
                target[begin - y : end - y, left - x : right - x] = rows


def _bands(content: bytes, source: _Source, names: Sequence[str], parts: int) -> Iterator[tuple[int, Planes]]:
    """Rows of channels from the top of the data window, each time with the number of the first."""
    _, top, _, bottom = source.part.data
    try:
        if source.number:
            yield top, _later_part(content, source.number, parts)
            return
        # The newer `File` decodes all channels of all rows at once.
        file = require_exr().InputFile(io.BytesIO(content))
        for first in range(top, bottom, BAND_ROWS):
            yield first, _rows(file, names, first, min(first + BAND_ROWS, bottom))
    # SystemError: text in its header is not UTF-8.
    except (OSError, RuntimeError, ValueError, TypeError, SystemError) as error:
        raise ImageFileError(UNREADABLE) from error


def _later_part(content: bytes, number: int, parts: int) -> Planes:
    """All channels of a part that is not the first."""
    file = require_exr().File(io.BytesIO(content), separate_channels=True, num_threads=0)
    if len(file.parts) != parts:
        # Parts that it cannot read are left out, and the others move up.
        raise ImageFileError(UNREADABLE)
    planes = {name: channel.pixels for name, channel in file.channels(number).items()}
    return {
        name: plane.view(np.int32) if plane.dtype == np.uint32 else plane for name, plane in planes.items()
    }


def _rows(file: Any, names: Sequence[str], first: int, last: int) -> Planes:
    """Rows of channels of the first part."""
    kinds = {name: channel.type for name, channel in file.header()["channels"].items()}
    planes: dict[str, NDArray[Any]] = {}
    for number, dtype in enumerate(KINDS):
        same = [name for name in names if kinds[name].v == number]
        if same:
            # A block is unpacked anew by each call, for all of its channels.
            read = file.channels(same, kinds[same[0]], first, last - 1)
            arrays = (np.frombuffer(rows, dtype).reshape(last - first, -1) for rows in read)
            planes |= dict(zip(same, arrays, strict=True))
    return planes


def _source(parts: Sequence[_Part]) -> _Source:
    """The picture of a file."""
    for form in (_plain, _grey, _layered):
        for number, part in enumerate(parts):
            for prefix, colors in form(part.full):
                return _Source(number, part, prefix, colors)
    names = sorted({name for part in parts for name in part.channels})
    deep = " Its pixels are deep: save it flattened." if any(part.deep for part in parts) else ""
    chroma = " Luminance with chroma is not read: save R, G and B." if {"RY", "BY"} & set(names) else ""
    raise ImageFileError(f"This EXR file has no picture; its channels are {', '.join(names)}.{deep}{chroma}")


def _plain(names: set[str]) -> Iterator[tuple[str, tuple[str, ...]]]:
    if names.issuperset(RGB):
        yield "", RGB


def _grey(names: set[str]) -> Iterator[tuple[str, tuple[str, ...]]]:
    if "Y" in names and "RY" not in names:
        yield "", ("Y",) * 3


def _layered(names: set[str]) -> Iterator[tuple[str, tuple[str, ...]]]:
    prefixes = {name.removesuffix("R") for name in names if name.endswith(".R")}
    known = {f"{layer}." for layer in LAYERS}
    for prefix in sorted(prefixes - known, key=lambda name: (not name.endswith("Combined."), name)):
        if all(prefix + color in names for color in RGB):
            yield prefix, RGB


def _chosen(source: _Source, parts: int) -> tuple[str, ...]:
    """Notes on the choice among parts and layers."""
    named = f" ('{source.part.name}')" if source.part.name else ""
    part = f"part {source.number + 1} of {parts}{named}" if parts > 1 else ""
    layer = f"the layer '{source.prefix[:-1]}'" if source.prefix else ""
    chosen = " and ".join(filter(None, (part, layer)))
    return (f"Of several pictures that it may hold, {chosen} was taken.",) if chosen else ()


def _check_size(parts: Sequence[_Part], shown: _Part, most: int) -> None:
    """Refuse too large files before anything is decoded."""
    width, height = shown.display[2] - shown.display[0], shown.display[3] - shown.display[1]
    if width * height > most:
        raise ImageFileError(too_many_pixels(most, f"{width} x {height} pixels, "))
    stored = 0
    for part in parts:
        left, top, right, bottom = part.data
        stored += (right - left) * (bottom - top) * 4 * len(part.channels)
    if stored > PIXEL_BYTES * most:
        raise ImageFileError(
            "The channels of this EXR file take more memory than is allowed. Save it with its colours alone."
        )


def _placed(part: _Part) -> tuple[str, ...]:
    """Notes on where the pixels lie."""
    if part.data == part.display:
        return ()
    (x, y), (left, top, right, bottom) = part.display[:2], part.shared
    if left == right or top == bottom:
        return ("None of its pixels lies in the picture: all of it was taken as black.",)
    place = f"columns {left - x} to {right - x - 1}, rows {top - y} to {bottom - y - 1}"
    return (f"Its pixels are {place} of the picture: what lies around them was taken as black.",)
