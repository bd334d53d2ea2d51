"""OpenEXR files: the linear picture and all its layers in one file, nothing rounded.

The picture has the channels R, G and B. A channel of a layer is named layer.channel, as in ``normal.X``.
Numbers of shapes and triangles are EXR's whole numbers, which have no sign: -1 is written as 4294967295.
"""

import io
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.errors import ImageFileError, MissingExtraError
from renderer.layers import LAYERS, Layer, Layers

RGB = ("R", "G", "B")
Planes = Mapping[str, NDArray[Any]]


def require_exr() -> ModuleType:
    """The library that EXR files need.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    try:
        import OpenEXR  # noqa: PLC0415  an extra that most installations do without
    except ImportError as error:
        raise MissingExtraError(
            "EXR files need the package OpenEXR. Install it with: pip install 'penumbra-render[exr]'"
        ) from error
    module: ModuleType = OpenEXR
    return module


def encode_exr(image: NDArray[np.floating], layers: Planes | None = None) -> bytes:
    """An EXR file of a linear image (H, W, 3) and its layers, losslessly compressed.

    Parameters
    ----------
    image : (H, W, 3)
        Written as float32.
    layers : mapping of str to (H, W) or (H, W, channels) float32 or int32

    Raises
    ------
    MissingExtraError
        If OpenEXR is not installed.
    """
    sheets = layers or {}
    with tempfile.NamedTemporaryFile(suffix=".exr") as file:
        write_exr(file.name, image.shape[:2], [(image, sheets)], tuple(sheets))
        return file.read()


def write_exr(
    path: str, size: Sequence[int], bands: Iterable[tuple[NDArray[np.floating], Planes]], names: Sequence[str]
) -> None:
    """Write an EXR file of a linear image and its layers that come in bands of rows, from top to bottom.

    Parameters
    ----------
    size
        Height and width, pixels.
    bands : iterable of ((h, W, 3), mapping of str to (h, W) or (h, W, channels) float32 or int32)
        The image is written as float32.
    names
        The layers of every band.

    Raises
    ------
    MissingExtraError
        If OpenEXR is not installed.
    """
    exr = require_exr()
    import Imath  # noqa: PLC0415  a part of OpenEXR

    real, whole = (
        Imath.Channel(Imath.PixelType(kind)) for kind in (Imath.PixelType.FLOAT, Imath.PixelType.UINT)
    )
    channels = dict.fromkeys(RGB, real)
    for layer in map(LAYERS.__getitem__, names):
        channels |= dict.fromkeys(_channels(layer), whole if layer.dtype == np.int32 else real)
    height, width = size
    header = exr.Header(width, height) | {
        "channels": channels,
        "compression": Imath.Compression(Imath.Compression.ZIP_COMPRESSION),
    }
    file = exr.OutputFile(path, header)
    try:
        for image, sheets in bands:
            planes = dict(zip(RGB, _planes(image.astype(np.float32, copy=False)), strict=True))
            for name in names:
                planes |= dict(zip(_channels(LAYERS[name]), _planes(sheets[name]), strict=True))
            file.writePixels({name: plane.tobytes() for name, plane in planes.items()}, len(image))
    finally:
        file.close()


def decode_exr(content: bytes) -> tuple[NDArray[np.float32], Layers]:
    """The image (H, W, 3) and the layers of an EXR file.

    Channels that are neither the picture's nor those of a layer are ignored.

    Raises
    ------
    MissingExtraError
        If OpenEXR is not installed.
    ImageFileError
        If the content is no EXR file, or has no channels R, G and B.
    """
    exr = require_exr()
    try:
        found = exr.File(io.BytesIO(content), separate_channels=True, num_threads=0).channels()
    except (RuntimeError, ValueError) as error:
        raise ImageFileError("This is not an EXR file that can be read.") from error
    planes = {name: channel.pixels for name, channel in found.items()}
    if not all(name in planes for name in RGB):
        raise ImageFileError(f"This EXR file has no picture; its channels are {', '.join(sorted(planes))}.")
    image = np.stack([planes[name].astype(np.float32) for name in RGB], axis=-1)
    complete = [layer for layer in LAYERS.values() if all(name in planes for name in _channels(layer))]
    return image, {layer.name: _layer(layer, planes) for layer in complete}


def _channels(layer: Layer) -> tuple[str, ...]:
    return tuple(f"{layer.name}.{channel}" for channel in layer.channels)


def _planes(values: NDArray[Any]) -> list[NDArray[Any]]:
    """Each channel as a contiguous (H, W) array, whole numbers without sign."""
    stacked = values.reshape(*values.shape[:2], -1)
    if stacked.dtype == np.int32:
        stacked = stacked.view(np.uint32)
    return [np.ascontiguousarray(stacked[:, :, i]) for i in range(stacked.shape[2])]


def _layer(layer: Layer, planes: Planes) -> NDArray[Any]:
    channels = [planes[name] for name in _channels(layer)]
    signed = [plane.view(np.int32) if plane.dtype == np.uint32 else plane for plane in channels]
    values = signed[0] if len(signed) == 1 else np.stack(signed, axis=-1)
    return values.astype(layer.dtype)
