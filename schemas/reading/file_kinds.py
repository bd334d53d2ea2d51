"""Recognising files by their first bytes, so that a picture given as a scene is called a picture."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Group = Literal["picture", "mesh", "array", "archive", "page", "other"]


@dataclass(frozen=True, slots=True)
class FileKind:
    """A kind of file, in words that follow "This is".

    Attributes
    ----------
    name
        A word for programs, such as `png`.
    phrase
        With its article, such as "a PNG picture".
    group
        Kinds of one group have the same cure.
    """

    name: str
    phrase: str
    group: Group


OBJ = FileKind("obj", "an OBJ mesh", "mesh")
PLY = FileKind("ply", "a PLY mesh", "mesh")
GLB = FileKind("glb", "a binary glTF mesh (GLB)", "mesh")
_ZIP = FileKind("zip", "a ZIP archive", "archive")
_TIFF = FileKind("tiff", "a TIFF picture", "picture")
_HDR = FileKind("hdr", "a Radiance picture (HDR)", "picture")
_PFM = FileKind("pfm", "a PFM picture", "picture")

# The signatures are those of the formats' own specifications.
_SIGNATURES: tuple[tuple[bytes, FileKind], ...] = (
    (b"\x89PNG\r\n\x1a\n", FileKind("png", "a PNG picture", "picture")),
    (b"\xff\xd8\xff", FileKind("jpeg", "a JPEG picture", "picture")),
    (b"GIF8", FileKind("gif", "a GIF picture", "picture")),
    (b"II*\x00", _TIFF),
    (b"MM\x00*", _TIFF),
    (b"\x76\x2f\x31\x01", FileKind("exr", "an OpenEXR picture", "picture")),
    (b"#?RADIANCE", _HDR),
    (b"#?RGBE", _HDR),
    (b"PF\n", _PFM),
    (b"Pf\n", _PFM),
    (b"\x93NUMPY", FileKind("npy", "a NumPy array (.npy)", "array")),
    (b"PK\x03\x04", _ZIP),
    (b"PK\x05\x06", _ZIP),
    (b"\x1f\x8b", FileKind("gzip", "a gzip archive", "archive")),
    (b"%PDF-", FileKind("pdf", "a PDF document", "other")),
    (b"glTF", GLB),
    (b"ply\n", PLY),
    (b"ply\r", PLY),
)
_WEBP = FileKind("webp", "a WebP picture", "picture")
_PAGE = FileKind("html", "a web page (HTML)", "page")

_HTML = re.compile(rb"\s*<(?:!doctype\s+html|html|head|body)\b", re.IGNORECASE)
# Lines may end as on old Macintoshes, the first may have a UTF-8 mark, and faces may come first.
_OBJ_LINE = re.compile(rb"(?:\A(?:\xef\xbb\xbf)?|[\r\n])[ \t]*(?:v[ \t]+[-+.\d]|f[ \t]+[-+]?\d)")
SCANNED_BYTES = 1 << 16
"""Bytes in which a mesh file is expected to have its first vertex."""

_CURES: dict[Group, str] = {
    "picture": "A scene names its pictures: give one as the 'asset' of a texture.",
    "mesh": "A scene names its meshes: give one as the 'asset' of a shape of type 'mesh', or make a scene of "
    "it with 'penumbra convert'.",
    "array": "Give the JSON file of the scene, not the pixels rendered from it.",
    "archive": "Unpack it and give the JSON file that it holds.",
    "page": "Download the file itself, not the page that shows it.",
    "other": "Give the JSON file of the scene.",
}


def recognise(content: bytes) -> FileKind | None:
    """Recognise the kind of a file by its first bytes; None for any other, JSON included."""
    for signature, kind in _SIGNATURES:
        if content.startswith(signature):
            return kind
    if content.startswith(b"RIFF") and content[8:12] == b"WEBP":
        return _WEBP
    beginning = content[:SCANNED_BYTES]
    if _HTML.match(beginning):
        return _PAGE
    # JSON has no line that begins with a bare "v 1.0" or "f 1".
    return OBJ if _OBJ_LINE.search(beginning) else None


def mistaken(content: bytes, wanted: str) -> str | None:
    r"""Name the kind of a file given in place of a document, and the cure; None for unknown content.

    >>> mistaken(b"PK\x03\x04", "a scene")
    'This is a ZIP archive, not a scene. Unpack it and give the JSON file that it holds.'
    """
    kind = recognise(content)
    return None if kind is None else f"This is {kind.phrase}, not {wanted}. {_CURES[kind.group]}"


def mistaken_object(content: object) -> str | None:
    """Name the kind of a JSON document given in place of a scene, and the cure; None if unknown.

    >>> mistaken_object({"scene": {"version": 1}, "quality": {}})
    "This is a job request, not a scene. Give what stands in its field 'scene'."
    """
    if not isinstance(content, Mapping) or "camera" in content:
        return None
    if "cam_config" in content:
        return "This is a CS171 scene. Make a scene of it with 'penumbra convert'."
    if isinstance(content.get("asset"), Mapping):
        return f"This is a glTF file, not a scene. {_CURES['mesh']}"
    if isinstance(content.get("scene"), Mapping):
        return "This is a job request, not a scene. Give what stands in its field 'scene'."
    return None
