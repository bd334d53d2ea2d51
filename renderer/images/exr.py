"""Writer of OpenEXR files: the linear picture and all its layers in one file, without rounding.

The picture has the channels R, G and B. A channel of a layer is named layer.channel, as in ``normal.X``.
Numbers of shapes and triangles are EXR's whole numbers, which have no sign: -1 is written as 4294967295.
"""

import tempfile
from collections.abc import Iterable, Mapping, Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.errors import MissingExtraError
from renderer.layers import LAYERS, Layer

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
        channels |= dict.fromkeys(channels_of(layer), whole if layer.dtype == np.int32 else real)
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
                planes |= dict(zip(channels_of(LAYERS[name]), _planes(sheets[name]), strict=True))
            file.writePixels({name: plane.tobytes() for name, plane in planes.items()}, len(image))
    finally:
        file.close()


def channels_of(layer: Layer) -> tuple[str, ...]:
    """Names of a layer's channels in a file."""
    return tuple(f"{layer.name}.{channel}" for channel in layer.channels)


def _planes(values: NDArray[Any]) -> list[NDArray[Any]]:
    """Each channel as a contiguous (H, W) array, whole numbers without sign."""
    stacked = values.reshape(*values.shape[:2], -1)
    if stacked.dtype == np.int32:
        stacked = stacked.view(np.uint32)
    return [np.ascontiguousarray(stacked[:, :, i]) for i in range(stacked.shape[2])]
