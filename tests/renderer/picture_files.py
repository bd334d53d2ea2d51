"""Picture files made byte by byte, or by OpenEXR: Pillow writes none of them."""

import io
import struct
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))
"""First column and row of each pass, and the steps to the next (ISO 15948, 8.2)."""


def chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def deep_png(codes: NDArray[Any], color_type: int, *, interlaced: bool = False, **chunks: bytes) -> bytes:
    """A PNG of 16 bits a channel with more chunks before its pixels; its rows take turns with two filters."""
    height, width, channels = codes.shape
    rows = []
    for x, y, right, down in ADAM7 if interlaced else ((0, 0, 1, 1),):
        part = codes[y::down, x::right].astype(">u2")
        for number, row in enumerate(part if part.size else ()):
            raw = list(row.tobytes())
            before = [0] * 2 * channels + raw
            sub = bytes((value - before[i]) % 256 for i, value in enumerate(raw))
            rows.append(b"\1" + sub if number % 2 else b"\0" + bytes(raw))
    header = struct.pack(">IIBBBBB", width, height, 16, color_type, 0, 0, interlaced)
    extra = b"".join(chunk(kind.encode(), content) for kind, content in chunks.items())
    body = chunk(b"IHDR", header) + extra + chunk(b"IDAT", zlib.compress(b"".join(rows)))
    return b"\x89PNG\r\n\x1a\n" + body + chunk(b"IEND", b"")


def tiff(pixels: NDArray[Any], order: str, photometric: int, **options: int) -> bytes:
    """A TIFF of one strip (or one a channel), whose numbers have the bits and kind of the array's.

    Parameters
    ----------
    order : {"<", ">"}
    photometric
        0 white is zero, 1 grey, 2 colours, 5 CMYK.
    options
        `packed` by Deflate, `extra` samples, `planes`, `orientation`.
    """
    height, width = pixels.shape[:2]
    channels = 1 if pixels.ndim == 2 else pixels.shape[2]
    stored = pixels.astype(pixels.dtype.newbyteorder(order))
    planes = options.get("planes", 1)
    strips = [stored[..., i].tobytes() for i in range(channels)] if planes == 2 else [stored.tobytes()]
    if options.get("packed"):
        strips = [zlib.compress(strip) for strip in strips]
    kind = {"u": 1, "i": 2, "f": 3}[pixels.dtype.kind]
    tags: dict[int, tuple[str, Sequence[int]]] = {
        256: ("I", [width]),
        257: ("I", [height]),
        258: ("H", [8 * pixels.dtype.itemsize] * channels),
        259: ("H", [8 if options.get("packed") else 1]),
        262: ("H", [photometric]),
        273: ("I", [0] * len(strips)),
        277: ("H", [channels]),
        278: ("I", [height]),
        279: ("I", [len(strip) for strip in strips]),
        284: ("H", [planes]),
        339: ("H", [kind] * channels),
    }
    tags |= {
        tag: ("H", [options[name]]) for name, tag in (("extra", 338), ("orientation", 274)) if name in options
    }
    first = 8 + 2 + 12 * len(tags) + 4
    long = {tag: struct.calcsize(f"={len(values)}{code}") for tag, (code, values) in tags.items()}
    begin = first + sum(size for size in long.values() if size > 4)
    tags[273] = ("I", [begin + sum(map(len, strips[:i])) for i in range(len(strips))])
    entries, outside = b"", b""
    for tag, (code, values) in sorted(tags.items()):
        raw = struct.pack(f"{order}{len(values)}{code}", *values)
        field = raw.ljust(4, b"\0") if len(raw) <= 4 else struct.pack(f"{order}I", first + len(outside))
        outside += raw if len(raw) > 4 else b""
        entries += struct.pack(f"{order}HHI", tag, {"H": 3, "I": 4}[code], len(values)) + field
    head = (b"II" if order == "<" else b"MM") + struct.pack(f"{order}HIH", 42, 8, len(tags))
    return head + entries + struct.pack(f"{order}I", 0) + outside + b"".join(strips)


def ppm(kind: str, codes: NDArray[Any], largest: int) -> bytes:
    head = f"P{kind}\n# a comment\n{codes.shape[1]} {codes.shape[0]}\n{largest}\n".encode()
    if kind == "6":
        return head + codes.astype(">u2").tobytes()
    return head + b"# another\n" + " ".join(map(str, codes.ravel().tolist())).encode()


def pfm(values: NDArray[np.float32], order: str) -> bytes:
    kind, scale = "PF" if values.ndim == 3 else "Pf", -1.0 if order == "<" else 1.0
    head = f"{kind}\n{values.shape[1]} {values.shape[0]}\n{scale}\n".encode()
    return head + values[::-1].astype(f"{order}f4").tobytes()


def hdr(body: bytes, size: str, kind: str = "32-bit_rle_rgbe") -> bytes:
    return f"#?RADIANCE\n# a comment\nFORMAT={kind}\nEXPOSURE=2\n\n{size}\n".encode() + body


def by_channels(line: NDArray[np.uint8]) -> bytes:
    """A line (W, 4) of run lengths a channel, runs of 3 and more as runs."""
    packed = b"\2\2" + struct.pack(">H", len(line))
    for channel in line.T.tolist():
        place = 0
        while place < len(channel):
            length = 1
            while (
                place + length < len(channel) and length < 127 and channel[place + length] == channel[place]
            ):
                length += 1
            packed += bytes([128 + length, channel[place]]) if length > 2 else bytes([1, channel[place]])
            place += length if length > 2 else 1
    return packed


def exr(channels: Mapping[str, NDArray[Any]], **header: Any) -> bytes:
    buffer = io.BytesIO()
    # It takes no account of strides.
    planes = {name: np.ascontiguousarray(plane) for name, plane in channels.items()}
    OpenEXR.File(header, planes).write(buffer)
    return buffer.getvalue()


def exr_of_parts(*parts: tuple[str, Mapping[str, NDArray[Any]]]) -> bytes:
    buffer = io.BytesIO()
    OpenEXR.File([OpenEXR.Part({}, dict(channels), name=name) for name, channels in parts]).write(buffer)
    return buffer.getvalue()
